"""Faults of real machines: instruments, drums, pulleys, masts and wind on the cables.

They stand beside the suite, and are run by name (`--case`). An effect that `discover` does not look
for stands for one outside the catalogue here: `acceptable` is what it looks like to first order.
"""

from .cases import case, effect, local, outside
from .imperfections import Imperfections

_WITH_TENSION = ("x", "y", "phi", "unstretched_length", "tension")

#: What a well-kept machine does to a recording.
_MILD = Imperfections(
    pose_colour=3e-3,
    pose_memory=0.5,
    jitter=1e-3,
    force_noise=15.0,
    pose_count=1e-3,
    length_count=1e-3,
)
_LAWS = {
    "play_2": outside("winch_play", 2, width=200.0),
    "rubbing": outside("rubbing", force=120.0, edge=0.0),
    "pendulum": outside("pendulum", mass=300.0, frequency=2.0, damping=0.02),
}

#: Laws that neither the catalogue nor its terms have.
STRANGE = [case(name, "outside", [law], local) for name, law in _LAWS.items()]
STRANGE += [
    case(f"{name}_mild", "outside", [law], local, imperfections=_MILD)
    for name, law in _LAWS.items()
]

#: Gusts that nobody recorded, and nothing else.
GUSTS = [
    case("gusts", "null", [], turbulence=30.0),
    case("gusts_mild", "null", [], turbulence=30.0, imperfections=_MILD),
]

MACHINE = [
    *STRANGE,
    case(
        "tension_gain_3",
        "single",
        [effect("tension_sensor_gain", 3, factor=0.02)],
        channels=_WITH_TENSION,
    ),
    case(
        "tension_bias_2",
        "single",
        [effect("tension_sensor_bias", 2, bias=150.0)],
        channels=_WITH_TENSION,
    ),
    case(
        "tension_gain_all",
        "single",
        [effect("tension_sensor_gain", factor=-0.03)],
        channels=_WITH_TENSION,
    ),
    case(
        "drum_eccentricity_1",
        "single",
        [
            effect(
                "winch_drum_eccentricity",
                1,
                compare=("eccentricity", "drum_radius"),
                eccentricity=0.01,
                drum_radius=0.3,
                phase=0.4,
            )
        ],
    ),
    case(
        "coulomb_2_asymmetric",
        "single",
        [
            effect(
                "winch_coulomb_friction",
                2,
                law="tanh",
                force=180.0,
                transition_speed=0.02,
                asymmetry=0.3,
            )
        ],
    ),
    case(
        "torque_ripple_2",
        "single",
        [effect("winch_torque_ripple", 2, amplitude=60.0, period=1.3, phase=0.5)],
    ),
    case(
        "cable_wind",
        "single",
        [effect("cable_wind", wind_x=6.0, wind_y=-3.0, drag_area_per_length=0.015)],
    ),
    case(
        "wrap_friction_4",
        "single",
        [
            effect(
                "pulley_wrap_friction",
                4,
                # Data show the product of friction and angle.
                compare=("transition_speed",),
                friction=0.01,
                wrap_angle=1.5,
                transition_speed=0.01,
            )
        ],
    ),
    case(
        "anchor_compliance_2",
        "outside",
        [effect("anchor_compliance", 2, stiffness=2.5e5)],
        acceptable=("cable_stiffness",),
    ),
    case(
        "hysteresis_1",
        "single",
        [effect("cable_hysteresis", 1, force=400.0, yield_strain=3e-5)],
    ),
    case(
        "pulley_3",
        "outside",
        [effect("pulley_radius", 3, radius=0.5)],
        acceptable=("anchor_offset",),
    ),
    case("pose_frame", "single", [effect("pose_sensor_frame", angle=3e-3)]),
    case("pose_scale", "single", [effect("pose_sensor_scale", factor=-1e-3)]),
]
