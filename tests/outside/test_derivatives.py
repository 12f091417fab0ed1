"""Directional and output derivatives against differences and against the reference."""

from __future__ import annotations

import re

import numpy as np
import pytest

from outside.cases import EFFECTS, random_case, starting
from outside.fmu import INPUTS, OUTPUTS, POSE, TWIST, indexed, start_values
from reference.parameters import (
    CABLE_MODELS,
    LUMPED_MASS,
    MASSLESS_SPRING,
    RIGID,
    Effect,
    Parameters,
)
from reference.plant import Plant

LENGTHS = tuple(indexed("unstretched_length"))
RATES = tuple(indexed("unstretched_length_rate"))
STATES = {
    RIGID: (*POSE, *TWIST),
    MASSLESS_SPRING: (*POSE, *TWIST, *LENGTHS),
    LUMPED_MASS: (*POSE, *TWIST, *LENGTHS, *RATES),
}
# Half-widths of the central differences: large against rounding, small against the curvature.
STEPS = {
    **dict.fromkeys(POSE, 1e-4),
    **dict.fromkeys(TWIST, 1e-3),
    **dict.fromkeys(LENGTHS, 1e-4),
    **dict.fromkeys(RATES, 1e-3),
    **dict.fromkeys(INPUTS, 10.0),
}


def unknowns_of(model: str) -> list[str]:
    return [*OUTPUTS, *(f"der({name})" for name in STATES[model])]


def jacobian(instance, unknowns, knowns) -> np.ndarray:
    """One column for each known."""
    rows = instance.fmu.references(unknowns)
    return np.column_stack(
        [
            instance.slave.getDirectionalDerivative(rows, instance.fmu.references([k]), [1.0])
            for k in knowns
        ]
    )


def reference_differences(case, y0, u0, unknowns, knowns) -> np.ndarray:
    """The same matrix from the independent model, by five-point differences.

    Of the knowns the states come first, in the model's order, then all inputs."""
    plant = Plant(case.parameters)
    states, inputs = knowns[: -len(u0)], knowns[-len(u0) :]

    def values(y, u):
        command, wrench = np.split(u, [plant.cables])
        rates = plant.evaluate(0.0, y, command, wrench)[0]
        known = plant.outputs(0.0, y, command, wrench)
        known |= {f"der({name})": rates[k] for k, name in enumerate(states)}
        return np.array([known[name] for name in unknowns])

    columns = []
    for name in knowns:
        # Cables beyond the fourth are moved as far as the first.
        h = STEPS[re.sub(r"\[\d+\]", "[1]", name)]

        def moved(amount, name=name):
            y, u = y0.copy(), u0.copy()
            if name in inputs:
                u[inputs.index(name)] += amount
            else:
                y[states.index(name)] += amount
            return values(y, u)

        columns.append((8 * (moved(h) - moved(-h)) - moved(2 * h) + moved(-2 * h)) / (12 * h))
    return np.column_stack(columns)


def assert_same_matrix(found, expected, unknowns, knowns, tolerance):
    """Equal relative to the largest entry of each row times the spread of each column."""
    size = np.max(np.abs(expected) * column_scale(knowns), axis=1, keepdims=True)
    error = np.abs(found - expected) * column_scale(knowns) / np.maximum(size, 1e-9)
    wrong = np.argwhere(~(error <= tolerance))
    assert not len(wrong), [
        (unknowns[i], knowns[j], found[i, j], expected[i, j]) for i, j in wrong[:10]
    ]


def column_scale(knowns) -> np.ndarray:
    """How far each known moves in practice, so that columns of different units compare."""
    scale = {"winch_force": 1e3, "disturbance_force": 1e3, "disturbance_torque": 1e4}
    return np.array(
        [scale.get(k.split("[")[0].removesuffix("_x").removesuffix("_y"), 1.0) for k in knowns]
    )


@pytest.mark.parametrize("model", CABLE_MODELS)
def test_directional_derivatives_equal_the_reference_linearised(fmu, model):
    case = random_case(3, model)
    y0, values = starting(case, Plant(case.parameters))
    unknowns, knowns = unknowns_of(model), [*STATES[model], *INPUTS]
    with fmu.instance(values=values | start_values(case.parameters)) as instance:
        found = jacobian(instance, unknowns, knowns)
    expected = reference_differences(case, y0, case.inputs.at(0.0), unknowns, knowns)
    assert_same_matrix(found, expected, unknowns, knowns, 1e-6)


@pytest.mark.parametrize("model", CABLE_MODELS)
def test_directional_derivatives_equal_differences_of_the_fmu(fmu, model):
    """Differences over start values: every state moved in an initialisation of its own."""
    case = random_case(4, model)
    _, values = starting(case, Plant(case.parameters))
    values |= start_values(case.parameters)
    unknowns, knowns = unknowns_of(model), [*STATES[model], *INPUTS]
    with fmu.instance(values=values) as instance:
        found = jacobian(instance, unknowns, knowns)
        columns = []
        for name in knowns:
            ends = []
            for sign in (1, -1):
                instance.slave.reset()
                instance.initialise(values | {name: values[name] + sign * STEPS[name]})
                ends.append(instance.get(unknowns))
            columns.append((ends[0] - ends[1]) / (2 * STEPS[name]))
    assert_same_matrix(found, np.column_stack(columns), unknowns, knowns, 1e-5)


@pytest.mark.parametrize("model", CABLE_MODELS)
def test_derivatives_in_the_middle_of_a_run(fmu, model):
    """After steps, with respect to inputs: an input set at a communication point shows at once."""
    case = random_case(5, model)
    _, values = starting(case, Plant(case.parameters))
    unknowns = unknowns_of(model)
    with fmu.instance(values=values | start_values(case.parameters)) as instance:
        for _ in range(5):
            instance.step(0.1)
        found = jacobian(instance, unknowns, INPUTS)
        columns = []
        for name in INPUTS:
            ends = []
            for sign in (1, -1):
                instance.set({name: values[name] + sign * STEPS[name]})
                ends.append(instance.get(unknowns))
            instance.set({name: values[name]})
            columns.append((ends[0] - ends[1]) / (2 * STEPS[name]))
    assert_same_matrix(found, np.column_stack(columns), unknowns, INPUTS, 1e-6)


@pytest.mark.parametrize(
    "name",
    [
        "platform_quadratic_drag",
        "winch_coulomb_friction",
        "platform_com_offset",
        "length_sensor_bias",
    ],
)
def test_derivatives_with_effects(pack, name):
    case = random_case(6, LUMPED_MASS, effects=(EFFECTS[name],))
    y0, values = starting(case, Plant(case.parameters))
    unknowns, knowns = unknowns_of(LUMPED_MASS), [*STATES[LUMPED_MASS], *INPUTS]
    with pack(case.parameters).instance(values=values) as instance:
        found = jacobian(instance, unknowns, knowns)
    expected = reference_differences(case, y0, case.inputs.at(0.0), unknowns, knowns)
    assert_same_matrix(found, expected, unknowns, knowns, 1e-6)


@pytest.mark.parametrize("initialization", ["from_winch_forces", "static_equilibrium"])
def test_derivatives_of_initial_unknowns_in_initialization_mode(fmu, initialization):
    """Table 4.2 of the standard: with respect to inputs, exact starts and parameters, there too.

    Held against differences of the FMU, each start moved by itself.
    """
    values = {f"winch_force[{i}]": 20e3 for i in range(1, 5)} | {"initialization": initialization}
    values |= {"disturbance_force_x": 200.0, "phi": 0.02}
    unknowns = [*indexed("cable_length"), *LENGTHS, *indexed("tension"), "der(vx)", "der(omega)"]
    listed = {u.variable.name for u in fmu.description.initialUnknowns}
    assert set(unknowns) <= listed
    # A push moves the pose at rest by 5e-3 m/N.
    widths = {"winch_force[2]": 10.0, "disturbance_force_x": 5.0, "x": 0.1, "phi": 1e-3}
    widths |= {"youngs_modulus": 1e7, "anchor_radius": 0.1, "platform_mass": 10.0}
    knowns = list(widths)
    with fmu.instance(start=False) as instance:
        instance.begin(values)
        found = jacobian(instance, unknowns, knowns)
        columns = []
        for name, width in widths.items():
            start = instance.get([name])[0]
            ends = []
            for amount in (width, -width, 2 * width, -2 * width):
                instance.set({name: start + amount})
                ends.append(instance.get(unknowns))
            instance.set({name: start})
            difference = 8 * (ends[0] - ends[1]) - (ends[2] - ends[3])
            columns.append(difference / (12 * width))
        instance.slave.exitInitializationMode()
        instance.step(0.1)
    scale = np.array(list(widths.values()))
    expected = np.column_stack(columns)
    size = np.max(np.abs(expected) * scale, axis=1, keepdims=True)
    # A tension is EA times a difference of two lengths near 1 km, so rounding shows at 1e-13 EA.
    rounding = np.array([[1.5e-6 if "tension" in name else 1e-9] for name in unknowns])
    wrong = np.argwhere(np.abs(found - expected) * scale > 1e-5 * size + rounding)
    assert not len(wrong), [(unknowns[i], knowns[j], found[i, j], expected[i, j]) for i, j in wrong]


def test_directional_derivative_is_linear_in_the_direction(fmu):
    case = random_case(9, LUMPED_MASS)
    _, values = starting(case, Plant(case.parameters))
    unknowns, knowns = unknowns_of(LUMPED_MASS), [*STATES[LUMPED_MASS], *INPUTS]
    direction = np.random.default_rng(1).normal(size=len(knowns))
    with fmu.instance(values=values | start_values(case.parameters)) as instance:
        matrix = jacobian(instance, unknowns, knowns)
        at_once = instance.slave.getDirectionalDerivative(
            fmu.references(unknowns), fmu.references(knowns), list(direction)
        )
    terms = np.abs(matrix) @ np.abs(direction)
    assert np.all(np.abs(np.array(at_once) - matrix @ direction) <= 1e-12 * terms + 1e-300)


def test_declared_dependencies_cover_all_that_the_derivatives_show(fmu):
    case = random_case(10, LUMPED_MASS)
    _, values = starting(case, Plant(case.parameters))
    knowns = [*STATES[LUMPED_MASS], *INPUTS]
    structure = {
        u.variable.name: {v.name for v in u.dependencies}
        for u in (*fmu.description.outputs, *fmu.description.derivatives)
        if u.variable.type == "Real"
    }
    names = list(structure)
    with fmu.instance(values=values | start_values(case.parameters)) as instance:
        matrix = jacobian(instance, names, knowns)
    for i, name in enumerate(names):
        shown = {k for k, value in zip(knowns, matrix[i], strict=True) if value != 0.0}
        assert shown <= structure[name], name
    # And the declaration is not simply "everything".
    assert structure["cable_length[1]"] == {"x", "y", "phi"}
    assert structure["der(x)"] == {"vx"}
    assert structure["omega"] == {"omega"}


@pytest.mark.parametrize("model", CABLE_MODELS)
def test_output_derivatives_equal_differences_over_a_small_step(fmu, model):
    case = random_case(12, model)
    _, values = starting(case, Plant(case.parameters))
    names = [
        *POSE,
        *TWIST,
        *indexed("cable_length"),
        *indexed("cable_angle"),
        *LENGTHS,
        *indexed("tension"),
        *indexed("strain"),
    ]
    h = 1e-4
    with fmu.instance(values=values | start_values(case.parameters)) as instance:
        for size in (0.3, 0.2):
            instance.step(size)
        references = fmu.references(names)
        samples, slopes = [instance.get(names)], []
        for _ in range(2):
            slopes.append(
                np.array(instance.slave.getRealOutputDerivatives(references, [1] * len(names)))
            )
            instance.step(h)
            samples.append(instance.get(names))
        middle = (samples[2] - samples[0]) / (2 * h)
    size = np.maximum(np.abs(slopes[1]), 1e-3 * np.abs(samples[0]))
    assert np.all(np.abs(slopes[1] - middle) <= 2e-4 * size + 1e-6), dict(
        zip(names, zip(slopes[1], middle, strict=True), strict=True)
    )


def test_output_derivative_of_a_ramped_tension_has_the_ramp_in_it(fmu):
    """Rigid cables pass the winch force on at once, so its slope is in the tension's slope."""
    case = random_case(13, RIGID)
    _, values = starting(case, Plant(case.parameters))
    tension, force = fmu.references(["tension[1]"]), fmu.references(["winch_force[1]"])
    with fmu.instance(values=values | start_values(case.parameters)) as instance:
        direct = instance.slave.getDirectionalDerivative(tension, force, [1.0])[0]
        still = instance.slave.getRealOutputDerivatives(tension, [1])[0]
        instance.slave.setRealInputDerivatives(force, [1], [400.0])
        ramped = instance.slave.getRealOutputDerivatives(tension, [1])[0]
    assert ramped - still == pytest.approx(400.0 * direct, rel=1e-9)
    assert 0.5 < direct < 1.0


def test_friction_far_above_its_transition_speed_is_flat(pack):
    """tanh is 1 there, and its slope 0, however far."""
    parameters = Parameters(
        effects=(
            Effect("winch_coulomb_friction", 1, {"force": 250.0, "transition_speed": 1e-3}),
            Effect("pulley_capstan_loss", 2, {"loss": 0.02}),
        )
    )
    plain = Parameters()
    y0 = Plant(plain).initial_state((0, 0, 0), command=[9000.0] * 4)
    values = {"initialization": "from_states", "x": 0.0, "y": 0.0, "phi": 0.0}
    values |= {f"winch_force[{i}]": 9000.0 for i in range(1, 5)}
    values |= {f"unstretched_length[{i}]": y0[5 + i] for i in range(1, 5)}
    values |= {f"unstretched_length_rate[{i}]": rate for i, rate in ((1, 2.0), (2, 20.0))}
    unknowns = [f"der({name})" for name in RATES[:2]]
    matrices = []
    for model in (plain, parameters):
        with pack(model).instance(values=values) as instance:
            matrices.append(jacobian(instance, unknowns, RATES[:2]))
            instance.step(0.01)
    assert matrices[1] == pytest.approx(matrices[0], rel=1e-9, abs=1e-12)
