"""Two and three effects at once."""

from .cases import case, effect

PAIRS = [
    case(
        "drag_and_gain",
        "pair",
        [
            effect("platform_quadratic_drag", coefficient=50.0),
            effect("winch_force_gain", 1, factor=-0.01),
        ],
    ),
    case(
        "coulomb_and_drag",
        "pair",
        [
            effect(
                "winch_coulomb_friction", 3, law="algebraic", force=120.0, transition_speed=0.01
            ),
            effect("platform_linear_drag", coefficient=60.0),
        ],
    ),
    case(
        "lag_and_gain",
        "pair",
        [effect("winch_lag", time_constant=0.1), effect("winch_force_gain", 4, factor=0.006)],
        dither=150.0,
    ),
    case(
        "com_and_wind",
        "pair",
        [
            effect("platform_com_offset", x=-0.2, y=0.3),
            effect("steady_wind", force_x=-40.0, force_y=50.0, torque=-300.0),
        ],
        rate=25.0,
    ),
    case(
        "stiffness_and_length_bias",
        "pair",
        [
            effect("cable_stiffness", 2, factor=-0.05),
            effect("length_sensor_bias", 4, bias=0.03),
        ],
    ),
    case(
        "mass_and_rotational_damping",
        "pair",
        [
            effect("platform_mass", mass=150.0),
            effect("platform_rotational_damping", coefficient=2e4),
        ],
        rate=20.0,
    ),
    case(
        "delay_and_coulomb",
        "pair",
        [
            effect("winch_delay", delay=0.1),
            effect("winch_coulomb_friction", 1, law="tanh", force=100.0, transition_speed=0.015),
        ],
        dither=150.0,
    ),
    case(
        "capstan_and_gust",
        "pair",
        [
            effect("pulley_capstan_loss", loss=0.006, extra={"smoothing_speed": 0.01}),
            effect("periodic_gust", amplitude=60.0, frequency=0.7, phase=1.0, direction=2.0),
        ],
    ),
    case(
        "anchor_and_bias",
        "pair",
        [effect("anchor_offset", 1, x=0.2, y=0.1), effect("winch_force_bias", 3, bias=60.0)],
    ),
    case(
        "drum_and_drag",
        "pair",
        [
            effect("winch_drum_inertia", mass=70.0),
            effect("platform_quadratic_drag", coefficient=45.0),
        ],
        dither=150.0,
        fastest=0.25,
    ),
    case(
        "umbilical_and_inertia",
        "pair",
        [
            effect("umbilical", stiffness=10.0, damping=20.0, x=-6.0, y=5.0),
            effect("platform_inertia", inertia=30e3),
        ],
    ),
    case(
        "thermal_and_wind",
        "pair",
        [
            effect("cable_thermal_expansion", strain_amplitude=5e-5, period=140.0, phase=-0.5),
            effect("steady_wind", force_x=30.0, force_y=20.0, torque=0.0),
        ],
        rate=40.0,
    ),
    case(
        "coulomb_two_winches",
        "pair",
        [
            effect("winch_coulomb_friction", 2, law="lugre", force=110.0, transition_speed=0.005),
            effect("winch_coulomb_friction", 4, law="lugre", force=160.0, transition_speed=0.005),
        ],
    ),
    case(
        "pose_delay_and_drag",
        "pair",
        [
            effect("pose_sensor_delay", delay=0.08),
            effect("platform_linear_drag", coefficient=60.0),
        ],
    ),
]

TRIPLES = [
    case(
        "drag_coulomb_mass",
        "triple",
        [
            effect("platform_linear_drag", coefficient=50.0),
            effect("winch_coulomb_friction", law="algebraic", force=100.0, transition_speed=0.01),
            effect("platform_mass", mass=200.0),
        ],
    ),
    case(
        "gain_lag_wind",
        "triple",
        [
            effect("winch_force_gain", 2, factor=0.006),
            effect("winch_lag", time_constant=0.1),
            effect("steady_wind", force_x=40.0, force_y=-60.0, torque=400.0),
        ],
        dither=150.0,
    ),
    case(
        "stiffness_viscous_gust",
        "triple",
        [
            effect("cable_stiffness", factor=-0.05),
            effect("winch_viscous_friction", 3, coefficient=100.0),
            effect("periodic_gust", amplitude=50.0, frequency=1.1, phase=-0.8, direction=-0.5),
        ],
    ),
    case(
        "com_drag_bias",
        "triple",
        [
            effect("platform_com_offset", x=0.3, y=0.1),
            effect("platform_quadratic_drag", coefficient=40.0),
            effect("winch_force_bias", 4, bias=-70.0),
        ],
    ),
    case(
        "delay_damping_length",
        "triple",
        [
            effect("winch_delay", delay=0.12),
            effect("platform_rotational_damping", coefficient=2e4),
            effect("length_sensor_bias", 1, bias=-0.03),
        ],
        dither=150.0,
    ),
]
