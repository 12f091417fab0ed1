"""What the plant is made of, and how each effect changes it.

An effect is a dictionary `{"id": ..., "cable": 1..n or None, "parameters": {...}}` with the
names and units of the catalogue. Two more keys belong to this generator only: `law`, which
smoothing of a friction law is used, and, for `outside`, which law outside the catalogue acts.
"""

import math

import numpy as np

from .robot import MOST_CABLES, TELESCOPE

AIR_DENSITY = 1.225  # kg/m3

# Friction laws: how sign(v) is smoothed.
LAWS = {"tanh": 0, "arctan": 1, "algebraic": 2, "lugre": 3}

# Laws outside the catalogue: name -> (code, coefficient names, targets, expression).
OUTSIDE = {
    "cross_coupling": (1, ("c",), ("platform.force_x",), "c*vy"),
    "skew_stiffness": (2, ("k",), ("platform.force_x",), "-k*x*abs(y)"),
    "cubic_spring": (3, ("k",), ("platform.force_y",), "-k*y^3"),
    "square_torque": (4, ("a", "omega"), ("platform.torque",), "a*tanh(5*sin(omega*t))"),
    "velocity_product_torque": (5, ("c",), ("platform.torque",), "c*vx*vy"),
    "drum_ripple": (6, ("a", "radius", "cable"), ("winch[cable]",), "a*sin(l/radius)"),
    "standing_wave_force": (
        7,
        ("a", "wavelength"),
        ("platform.force_x",),
        "a*sin(2*pi*x/wavelength)",
    ),
    "magnus_force": (8, ("c",), ("platform.force_y",), "c*omega*vx"),
    "winch_crosstalk": (9, ("c", "from", "cable"), ("winch[cable]",), "c*u[from]"),
    "winch_play": (10, ("width", "cable"), ("winch[cable]",), "the force follows with play"),
    "rubbing": (
        11,
        ("force", "edge"),
        ("platform.force_x",),
        "-force*tanh(vx/0.02) where x > edge",
    ),
    "pendulum": (
        12,
        ("mass", "frequency", "damping"),
        ("platform.force_x",),
        "a mass on a spring along x",
    ),
}

_SCALARS = (
    "cables rigid mass inertia com_x com_y rho gravity_x gravity_y "
    "thermal_amplitude thermal_period thermal_phase "
    "linear_drag quadratic_drag wind_x wind_y rotational_damping steady_x steady_y steady_torque "
    "gust_amplitude gust_frequency gust_phase gust_direction umbilical_k umbilical_d umbilical_x "
    "umbilical_y outside feed_mass feed_inertia lever winch_mass usual_length least most "
    "air_x air_y air_area air_exponent air_ground air_reference"
)
_CABLES = (
    "anchor_x anchor_y body_x body_y ea bl beta creep_ea creep_tau sag_weight sag_tension "
    "drag_area friction_law coulomb static stribeck_speed smoothing viscous bristle_stiffness "
    "bristle_damping capstan capstan_speed gain bias lag delay lower upper drum asymmetry "
    "wrap wrap_speed ripple ripple_period ripple_phase mast rope rope_strain "
    "pulley"
)
# Everything the plant needs, as a record that compiled code reads by name without reference counts.
PARAMS = np.dtype(
    (
        np.record,
        [(name, float) for name in _SCALARS.split()]
        + [(name, float, MOST_CABLES) for name in _CABLES.split()]
        + [("outside_coefficients", float, 4)],
    )
)


def nominal(cable_model="lumped_mass", robot=TELESCOPE):
    """The plant without any effect, as a dictionary that `freeze` turns into a record."""
    if cable_model not in ("lumped_mass", "rigid"):
        raise ValueError(f"cable_model: found {cable_model!r}, expected lumped_mass or rigid")
    n = robot.cables
    values = {name: 0.0 for name in _SCALARS.split()}
    values.update({name: np.zeros(n) for name in _CABLES.split()})
    anchors, attachments = np.array(robot.anchors), np.array(robot.attachments)
    values.update(
        cables=float(n),
        rigid=1.0 if cable_model == "rigid" else 0.0,
        mass=robot.mass,
        inertia=robot.inertia,
        rho=robot.density,
        gravity_x=robot.gravity[0],
        gravity_y=robot.gravity[1],
        thermal_period=1.0,
        anchor_x=anchors[:, 0].copy(),
        anchor_y=anchors[:, 1].copy(),
        body_x=attachments[:, 0].copy(),
        body_y=attachments[:, 1].copy(),
        ea=np.full(n, robot.stiffness),
        bl=np.full(n, robot.damping),
        lower=np.full(n, -math.inf),
        upper=np.full(n, math.inf),
        smoothing=np.ones(n),
        stribeck_speed=np.ones(n),
        capstan_speed=np.ones(n),
        wrap_speed=np.ones(n),
        ripple_period=np.ones(n),
        mast=np.full(n, math.inf),
        rope_strain=np.ones(n),
        air_reference=1.0,
        sag_tension=np.ones(n),
        creep_tau=np.ones(n),
        feed_mass=robot.feed_mass,
        feed_inertia=robot.feed_inertia,
        lever=robot.lever,
        winch_mass=robot.winch_mass,
        usual_length=robot.usual_length,
        least=robot.least,
        most=robot.most,
        outside_coefficients=np.zeros(4),
    )
    return values


def freeze(values):
    """Turn the dictionary into the record that compiled code takes."""
    record = np.zeros(1, PARAMS)
    for name, value in values.items():
        if np.ndim(value):
            record[name][0, : len(value)] = value
        else:
            record[name][0] = value
    return record[0]


def _friction(values, cables, law, coulomb, static, stribeck_speed, smoothing, viscous):
    """Set one friction law; a cable carries at most one."""
    for i in cables:
        if values["coulomb"][i] or values["viscous"][i]:
            raise ValueError(f"cable {i + 1}: found a second friction law, expected one")
        values["friction_law"][i] = LAWS[law]
        values["coulomb"][i] = coulomb
        values["static"][i] = static
        values["stribeck_speed"][i] = stribeck_speed
        values["smoothing"][i] = smoothing
        values["viscous"][i] = viscous
        if law == "lugre":
            # The bristle yields after one smoothing length (read as metres per metre/second), and
            # is damped about half critically on the cable's own lumped mass.
            stiffness = coulomb / smoothing
            values["bristle_stiffness"][i] = stiffness
            values["bristle_damping"][i] = math.sqrt(stiffness * values["winch_mass"])


def apply_effect(values, effect):
    """Change `values` by one effect. Sensor effects act on the readings, so they pass here."""
    kind, p = effect["id"], effect["parameters"]
    cable = effect.get("cable")
    cables = range(int(values["cables"])) if cable is None else [cable - 1]
    law = effect.get("law", "tanh")

    def each(name, value):
        for i in cables:
            values[name][i] = value

    match kind:
        case "cable_elasticity":
            each("ea", p["axial_stiffness"])
            each("bl", p["damping"])
        case "cable_stiffness":
            for i in cables:
                values["ea"][i] *= 1.0 + p["factor"]
        case "cable_damping":
            for i in cables:
                values["bl"][i] *= 1.0 + p["factor"]
        case "cable_creep":
            each("creep_ea", p["axial_stiffness"])
            each("creep_tau", p["time_constant"])
        case "cable_stiffening":
            each("beta", p["coefficient"])
        case "cable_sag":
            each("sag_weight", p["weight"])
            each("sag_tension", p["reference_tension"])
        case "cable_thermal_expansion":
            values["thermal_amplitude"] = p["strain_amplitude"]
            values["thermal_period"] = p["period"]
            values["thermal_phase"] = p["phase"]
        case "cable_drag":
            each("drag_area", p["drag_area_per_length"])
        case "winch_coulomb_friction":
            force, speed = p["force"], p["transition_speed"]
            _friction(values, cables, law, force, force, 1.0, speed, 0.0)
            each("asymmetry", p.get("asymmetry", 0.0))
        case "winch_viscous_friction":
            _friction(values, cables, "tanh", 0.0, 0.0, 1.0, 1.0, p["coefficient"])
        case "winch_stribeck_friction":
            smoothing = effect["smoothing_speed"]
            _friction(
                values,
                cables,
                law,
                p["coulomb"],
                p["static"],
                p["stribeck_speed"],
                smoothing,
                p["viscous"],
            )
        case "pulley_capstan_loss":
            each("capstan", p["loss"])
            each("capstan_speed", effect["smoothing_speed"])
        case "pulley_wrap_friction":
            each("wrap", p["friction"] * p["wrap_angle"])
            each("wrap_speed", p["transition_speed"])
        case "winch_torque_ripple":
            each("ripple", p["amplitude"])
            each("ripple_period", p["period"])
            each("ripple_phase", p["phase"])
        case "winch_force_gain":
            each("gain", p["factor"])
        case "winch_force_bias":
            each("bias", p["bias"])
        case "winch_lag":
            each("lag", p["time_constant"])
        case "winch_delay":
            each("delay", p["delay"])
        case "winch_saturation":
            each("lower", p["lower"])
            each("upper", p["upper"])
        case "winch_drum_inertia":
            each("drum", p["mass"])
        case "platform_mass":
            values["mass"] += p["mass"]
        case "platform_inertia":
            values["inertia"] += p["inertia"]
        case "platform_com_offset":
            values["com_x"], values["com_y"] = p["x"], p["y"]
        case "platform_linear_drag":
            values["linear_drag"] = p["coefficient"]
        case "platform_quadratic_drag":
            values["quadratic_drag"] = p["coefficient"]
            values["wind_x"], values["wind_y"] = p.get("wind_x", 0.0), p.get("wind_y", 0.0)
        case "platform_rotational_damping":
            values["rotational_damping"] = p["coefficient"]
        case "steady_wind":
            values["steady_x"], values["steady_y"] = p["force_x"], p["force_y"]
            values["steady_torque"] = p["torque"]
        case "periodic_gust":
            for name in ("amplitude", "frequency", "phase", "direction"):
                values[f"gust_{name}"] = p[name]
        case "umbilical":
            values["umbilical_k"], values["umbilical_d"] = p["stiffness"], p["damping"]
            values["umbilical_x"], values["umbilical_y"] = p["x"], p["y"]
        case "cable_wind":
            values["air_x"], values["air_y"] = p["wind_x"], p["wind_y"]
            values["air_area"] = p["drag_area_per_length"]
            values["air_exponent"] = p.get("exponent", 0.0)
            values["air_ground"] = p.get("ground", 0.0)
            values["air_reference"] = p.get("reference_height", 10.0)
        case "cable_hysteresis":
            each("rope", p["force"])
            each("rope_strain", p["yield_strain"])
        case "pulley_radius":
            each("pulley", p["radius"])
        case "anchor_compliance":
            each("mast", p["stiffness"])
        case "anchor_offset":
            for i in cables:
                values["anchor_x"][i] += p["x"]
                values["anchor_y"][i] += p["y"]
        case "attachment_offset":
            for i in cables:
                values["body_x"][i] += p["x"]
                values["body_y"][i] += p["y"]
        case (
            "length_sensor_bias"
            | "length_sensor_scale"
            | "tension_sensor_gain"
            | "tension_sensor_bias"
            | "winch_drum_eccentricity"
            | "pose_sensor_bias"
            | "pose_sensor_delay"
            | "pose_sensor_frame"
            | "pose_sensor_scale"
        ):
            pass
        case "outside":
            code, names, _, _ = OUTSIDE[effect["law"]]
            values["outside"] = float(code)
            for slot, name in enumerate(names):
                values["outside_coefficients"][slot] = p[name] if name != "cable" else cable
        case _:
            raise ValueError(f"effect id: found {kind!r}, expected an id of the catalogue")


def build(effects=(), cable_model="lumped_mass", robot=TELESCOPE):
    """The plant's parameters with these effects in place."""
    values = nominal(cable_model, robot)
    for effect in effects:
        apply_effect(values, effect)
    return freeze(values)


def build_in_time(effects=(), cable_model="lumped_mass", robot=TELESCOPE):
    """The plants that follow one another, and the times (s) at which each but the first begins.

    An effect may have `from` and `until` beside its parameters.
    """
    ends = [item[key] for item in effects for key in ("from", "until") if key in item]
    switches = np.unique(np.array(ends, float))
    plants = np.zeros(len(switches) + 1, PARAMS)
    for stage, begin in enumerate([-math.inf, *switches]):
        at_work = [
            item
            for item in effects
            if item.get("from", -math.inf) <= begin < item.get("until", math.inf)
        ]
        plants[stage] = build(at_work, cable_model, robot)
    return plants, switches


def step_size(params):
    """A Runge-Kutta step (s) well inside the fastest rate of the plant.

    Without friction the fastest motion is that of the winches' masses on their cables (near
    13 rad/s at the telescope), and its damping. Smoothed friction on the lumped mass adds a real
    rate of slope over mass; a bristle adds the rate of its own yielding.
    """
    mass, length = params.winch_mass, params.usual_length
    rate = 0.0
    for i in range(int(params.cables)):
        inertia = mass + params.drum[i] + (0.4 * params.mass if params.rigid else 0.0)
        slope = max(params.coulomb[i], params.static[i]) / params.smoothing[i]
        slope *= 1.0 + abs(params.asymmetry[i])
        slope += params.capstan[i] * params.most / 3.0 / params.capstan_speed[i]
        slope += params.wrap[i] * params.most / 3.0 / params.wrap_speed[i]
        rate = max(rate, slope / inertia + params.viscous[i] / inertia)
        if not params.rigid:
            rate = max(
                rate, math.sqrt(params.ea[i] / length / inertia), params.bl[i] / length / inertia
            )
        if params.friction_law[i] == LAWS["lugre"]:
            rate = max(rate, params.bristle_damping[i] / inertia + 2.0 / params.smoothing[i])
        if params.lag[i] > 0.0:
            rate = max(rate, 1.0 / params.lag[i])
        if params.rope[i] > 0.0:
            ea = params.ea[i] + params.rope[i] / params.rope_strain[i]
            rate = max(rate, math.sqrt(ea / length / inertia))
    return min(2e-3, 0.15 / rate if rate > 0.0 else 2e-3)
