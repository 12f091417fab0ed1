"""Random cases for comparing the FMU with the reference, and the comparison."""

from __future__ import annotations

import math
from dataclasses import dataclass, replace

import numpy as np

from outside.fmu import (
    OUTPUTS,
    POSE,
    TWIST,
    Instance,
    input_values,
    output_names,
    start_values,
)
from reference.parameters import LUMPED_MASS, MASSLESS_SPRING, Effect, Inputs, Parameters
from reference.plant import Plant
from reference.simulation import simulate

# Errors are relative to the largest magnitude of the quantity in the run, but not to less than
# what a run of this size resolves: a tension is EA times the difference of two lengths near 1 km
# with 1e-16 relative rounding each.
FLOOR = {
    "x": 1e-2,
    "y": 1e-2,
    "phi": 1e-3,
    "vx": 1e-2,
    "vy": 1e-2,
    "omega": 1e-3,
    "unstretched_length_rate": 1e-2,
    "tension": 100.0,
    "strain": 1e-5,
    "winch_rate": 2e-2,
    "ax": 1e-2,
    "ay": 1e-2,
    "alpha": 1e-3,
}


@dataclass
class Case:
    """A model, where it starts, and what drives it."""

    parameters: Parameters
    pose: tuple[float, float, float]
    twist: tuple[float, float, float]
    inputs: Inputs
    end: float

    def grid(self, count: int = 21) -> np.ndarray:
        """Equally spaced output times."""
        return np.linspace(0.0, self.end, count)


def random_case(seed: int, cable_model: str, cable_inertia: str = "paper", **changes) -> Case:
    """Parameters within ±20 % of the paper's, a pose of several metres, a moving start, inputs and
    disturbances that jump."""
    rng = np.random.default_rng(seed)

    def near(value):
        return float(value * rng.uniform(0.8, 1.2))

    base = Parameters()
    parameters = replace(
        base,
        platform_mass=near(base.platform_mass),
        platform_inertia=near(base.platform_inertia),
        anchor_radius=near(base.anchor_radius),
        attachment_radius=near(base.attachment_radius),
        anchor_angle=tuple(a + rng.uniform(-0.1, 0.1) for a in base.anchor_angle),
        attachment_angle=tuple(a + rng.uniform(-0.1, 0.1) for a in base.attachment_angle),
        cable_density=near(base.cable_density),
        youngs_modulus=near(base.youngs_modulus),
        cable_area=near(base.cable_area),
        cable_damping=near(base.cable_damping),
        cable_model=cable_model,
        cable_inertia=cable_inertia,
    )
    parameters = replace(parameters, **changes)
    # Massless springs have a pole near -760 1/s, slow work for the reference's explicit method.
    without_axial_mass = cable_model == LUMPED_MASS and cable_inertia == "none"
    end = 1.5 if cable_model == MASSLESS_SPRING or without_axial_mass else 4.0
    knots = np.concatenate([[0.0], np.sort(rng.uniform(0.05, 0.95, 5)) * end])
    values = np.column_stack(
        [
            rng.uniform(6000.0, 12000.0, (6, 4)),
            rng.uniform(-400.0, 400.0, (6, 2)),
            rng.uniform(-3000.0, 3000.0, 6),
        ]
    )
    pose = (*rng.uniform(-20.0, 20.0, 2), rng.uniform(-0.3, 0.3))
    twist = (*rng.uniform(-1.0, 1.0, 2), rng.uniform(-0.02, 0.02))
    as_floats = [tuple(float(v) for v in vector) for vector in (pose, twist)]
    return Case(parameters, *as_floats, Inputs(knots, values), end)


def starting(case: Case, plant: Plant) -> tuple[np.ndarray, dict]:
    """The reference's state, and the FMU's start values for the same state.

    Start values are what the sensors show.
    """
    command, wrench = np.split(case.inputs.at(0.0), [plant.cables])
    plant = plant.at(0.0)
    y0 = plant.initial_state(case.pose, case.twist, command=command)
    if plant.has_length_rate:
        # A start that is not at rest along the cables either.
        y0[plant.length_rates] = plant.motion(y0[:3], y0[3:6]).L_rate * (1.0 - 1e-3)
    shown = plant.outputs(0.0, y0, command, wrench)
    states = [*POSE, *TWIST]
    cables = range(1, plant.cables + 1)
    if plant.has_length:
        states += [f"unstretched_length[{i}]" for i in cables]
    if plant.has_length_rate:
        states += [f"unstretched_length_rate[{i}]" for i in cables]
    values = input_values(case.inputs, command=case.parameters.command) | {
        "initialization": "from_states"
    }
    return y0, values | {name: shown[name] for name in states}


def reference_run(case: Case, t_out, creep=()) -> dict[str, np.ndarray]:
    """What the reference says; `creep` are the creep strains at the start."""
    plant = Plant(case.parameters)
    y0, _ = starting(case, plant)
    y0[plant.first_creep : plant.first_lag] = creep
    return simulate(plant, y0, case.inputs, t_out).outputs


def fmu_run(case: Case, instance: Instance, t_out, steps=None, through_fmi=True, **options):
    """What the FMU says; its parameters are set through FMI unless its model has them already."""
    plant = Plant(case.parameters)
    _, values = starting(case, plant)
    if through_fmi:
        values |= start_values(case.parameters)
    if plant.has_length and not plant.has_length_rate:
        # Here the rate of a length is EA/bl = 760 1/s times the error of the length.
        options.setdefault("relative_tolerance", 1e-11)
    instance.initialise(values | options)
    return instance.run(case.inputs, t_out, steps, names=output_names(plant.cables))


def relative_errors(found, expected, names=OUTPUTS) -> dict[str, float]:
    """The largest error of each quantity, relative to its size in the run."""
    errors = {}
    for name in names:
        difference = found[name] - expected[name]
        if name.startswith("cable_angle"):
            difference = np.remainder(difference + math.pi, 2 * math.pi) - math.pi
        size = max(np.max(np.abs(expected[name])), FLOOR.get(name.split("[")[0], 0.0))
        errors[name] = float(np.max(np.abs(difference)) / size)
    return errors


def assert_close(found, expected, tolerance=1e-6, names=OUTPUTS):
    """All quantities agree, and say which do not."""
    errors = relative_errors(found, expected, names)
    wrong = {name: error for name, error in errors.items() if not error <= tolerance}
    assert not wrong, dict(sorted(wrong.items(), key=lambda item: -item[1]))


FIRST_EFFECTS = (
    "platform_quadratic_drag",
    "winch_coulomb_friction",
    "winch_lag",
    "winch_delay",
    "platform_com_offset",
    "length_sensor_bias",
)
# Every effect of the catalogue, of a size that shows in a run of a few seconds.
CATALOGUE = {
    name: Effect(name, cable, values)
    for name, cable, values in (
        ("cable_elasticity", None, {"axial_stiffness": 1.1e7, "damping": 3e4}),
        ("cable_stiffness", 2, {"factor": -0.15}),
        ("cable_damping", None, {"factor": 3.0}),
        ("cable_creep", 1, {"axial_stiffness": 4e7, "time_constant": 3.0}),
        ("cable_hysteresis", None, {"force": 300.0, "yield_strain": 2e-4}),
        ("cable_stiffening", None, {"coefficient": 2e5}),
        ("cable_sag", 4, {"weight": 6.0, "reference_tension": 9e3}),
        ("cable_catenary", 2, {"weight": 5.0}),
        (
            "cable_thermal_expansion",
            None,
            {"strain_amplitude": 2e-4, "period": 15.0, "phase": 0.4},
        ),
        ("cable_drag", None, {"drag_area_per_length": 0.05}),
        (
            "cable_wind",
            None,
            {
                "wind_x": 9.0,
                "wind_y": -4.0,
                "drag_area_per_length": 0.02,
                "exponent": 0.15,
                "ground": -900.0,
            },
        ),
        (
            "cable_transverse_mode",
            None,
            {"linear_density": 0.4, "drag_area_per_length": 0.05, "damping_ratio": 0.03},
        ),
        ("cable_axial_mass", 2, {"linear_density": 0.4}),
        (
            "winch_coulomb_friction",
            3,
            {
                "force": 250.0,
                "transition_speed": 0.05,
                "tail": 0.4,
                "presliding_stiffness": 5e4,
                "presliding_damping": 1e3,
                "damping_speed": 0.2,
                "asymmetry": 0.15,
            },
        ),
        ("winch_viscous_friction", 1, {"coefficient": 300.0}),
        (
            "winch_stribeck_friction",
            2,
            {
                "coulomb": 150.0,
                "static": 260.0,
                "stribeck_speed": 0.5,
                "viscous": 20.0,
                "transition_speed": 0.08,
                "asymmetry": -0.2,
            },
        ),
        ("pulley_capstan_loss", 4, {"loss": 0.02}),
        ("pulley_wrap_friction", 3, {"friction": 0.08, "wrap_angle": 1.5}),
        ("pulley_radius", None, {"radius": 4.0}),
        ("winch_torque_ripple", 2, {"amplitude": 150.0, "period": 1.2, "phase": 0.5}),
        ("winch_force_gain", 1, {"factor": -0.07}),
        ("winch_force_bias", None, {"bias": 130.0}),
        ("winch_dead_band", None, {"band": 120.0, "time_constant": 0.08}),
        ("winch_lag", None, {"time_constant": 0.15, "rate_limit": 4000.0}),
        ("winch_delay", 2, {"delay": 0.137}),
        ("winch_saturation", None, {"lower": 7000.0, "upper": 9000.0}),
        ("winch_power_limit", None, {"power": 2500.0}),
        ("winch_drum_inertia", 3, {"mass": 80.0}),
        ("platform_mass", None, {"mass": 300.0}),
        ("platform_inertia", None, {"inertia": -5e4}),
        ("platform_com_offset", None, {"x": 0.6, "y": -0.9}),
        ("platform_linear_drag", None, {"coefficient": 150.0}),
        ("platform_quadratic_drag", None, {"coefficient": 40.0, "wind_x": 3.0, "wind_y": -2.0}),
        ("platform_rotational_damping", None, {"coefficient": 8e4}),
        ("steady_wind", None, {"force_x": 150.0, "force_y": -90.0, "torque": 900.0}),
        (
            "periodic_gust",
            None,
            {"amplitude": 400.0, "frequency": 2.0, "phase": 0.3, "direction": 0.8},
        ),
        ("umbilical", None, {"stiffness": 25.0, "damping": 60.0, "x": 10.0, "y": -30.0}),
        ("anchor_offset", 1, {"x": 0.8, "y": -0.5}),
        ("anchor_compliance", 4, {"stiffness": 2e5}),
        ("attachment_offset", 2, {"x": 0.3, "y": 0.2}),
        ("length_sensor_bias", 4, {"bias": 0.12}),
        ("length_sensor_scale", None, {"factor": 1e-3}),
        (
            "winch_drum_eccentricity",
            3,
            {"eccentricity": 0.02, "drum_radius": 0.3, "phase": 0.9},
        ),
        (
            "winch_drum_layers",
            2,
            {"cable_diameter": 0.01, "turns": 40.0, "drum_radius": 0.5},
        ),
        ("tension_sensor_gain", 3, {"factor": -0.04}),
        ("tension_sensor_bias", None, {"bias": 60.0}),
        ("pose_sensor_bias", None, {"x": 0.2, "y": -0.1, "phi": 0.01}),
        ("pose_sensor_delay", None, {"delay": 0.1}),
        ("pose_sensor_frame", None, {"angle": 0.02, "x": 0.6, "y": -0.4}),
        ("pose_sensor_scale", None, {"factor": 5e-3}),
        (
            "expression",
            None,
            {"target": "platform.force_x", "expression": "-9.5*x*abs(vy) + 80*sin(3*time)"},
        ),
    )
}
EFFECTS = {name: CATALOGUE[name] for name in FIRST_EFFECTS}
