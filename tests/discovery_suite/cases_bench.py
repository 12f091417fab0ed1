"""Effects of the catalogue on the bench of 4 m with six cables: sizes of a laboratory's machine."""

from .cases import case, effect
from .cases_cables import on_bench

#: Tensions are some 200 N and the platform has 20 kg.
LAWS_ON_BENCH = [
    case("stiffness_2", "single", [effect("cable_stiffness", 2, factor=-0.3)], on_bench),
    case("stiffness_all", "single", [effect("cable_stiffness", factor=0.3)], on_bench),
    case(
        "coulomb_all",
        "single",
        [effect("winch_coulomb_friction", law="tanh", force=2.0, transition_speed=0.005)],
        on_bench,
    ),
    case(
        "coulomb_3_arctan",
        "single",
        [effect("winch_coulomb_friction", 3, law="arctan", force=4.0, transition_speed=0.002)],
        on_bench,
    ),
    case("viscous_1", "single", [effect("winch_viscous_friction", 1, coefficient=8.0)], on_bench),
    case("viscous_all", "single", [effect("winch_viscous_friction", coefficient=5.0)], on_bench),
    case(
        "capstan_all",
        "single",
        [effect("pulley_capstan_loss", loss=0.015, extra={"smoothing_speed": 0.002})],
        on_bench,
    ),
    case("gain_4", "single", [effect("winch_force_gain", 4, factor=-0.015)], on_bench),
    case("gain_all", "single", [effect("winch_force_gain", factor=0.03)], on_bench),
    case("bias_6", "single", [effect("winch_force_bias", 6, bias=2.0)], on_bench),
    case("lag_all", "single", [effect("winch_lag", time_constant=0.01)], on_bench, dither=1.5),
    case("delay_all", "single", [effect("winch_delay", delay=0.012)], on_bench, dither=1.5),
    case("drum_inertia_5", "single", [effect("winch_drum_inertia", 5, mass=0.8)], on_bench),
    case("inertia", "single", [effect("platform_inertia", inertia=0.15)], on_bench),
    case("com_offset", "single", [effect("platform_com_offset", x=0.008, y=-0.005)], on_bench),
    case("linear_drag", "single", [effect("platform_linear_drag", coefficient=6.0)], on_bench),
    case(
        "steady_wind",
        "single",
        [effect("steady_wind", force_x=2.0, force_y=-1.0, torque=0.1)],
        on_bench,
    ),
    case("anchor_3", "single", [effect("anchor_offset", 3, x=0.004, y=-0.003)], on_bench),
    case("attachment_1", "single", [effect("attachment_offset", 1, x=2e-3, y=1e-3)], on_bench),
    case("length_bias_2", "single", [effect("length_sensor_bias", 2, bias=3e-3)], on_bench),
    case(
        "mass_gain_2",
        "pair",
        [effect("platform_mass", mass=0.8), effect("winch_force_gain", 2, factor=0.015)],
        on_bench,
    ),
    case(
        "coulomb_1_bias_4",
        "pair",
        [
            effect("winch_coulomb_friction", 1, law="tanh", force=3.0, transition_speed=0.01),
            effect("winch_force_bias", 4, bias=2.5),
        ],
        on_bench,
    ),
]
