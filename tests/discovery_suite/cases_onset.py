"""Effects that begin, end or change their size while the robot moves.

Times are on the clock of each trial, and alike in all of them. They stand beside the suite, and
are run by name (`--case`).
"""

from .cases import case, effect


def during(begin, end, kind, cable=None, **values):
    """An effect that is at work from `begin` until `end` (s); None: always before, or after."""
    times = {"from": begin, "until": end}
    at_work = {key: time for key, time in times.items() if time is not None}
    return effect(kind, cable, extra=at_work, **values)


def _friction(begin, end, cable, force):
    return during(
        begin,
        end,
        "winch_coulomb_friction",
        cable,
        law="tanh",
        force=force,
        transition_speed=0.02,
    )


ONSET = [
    case("onset_gain_3", "onset", [during(40.0, None, "winch_force_gain", 3, factor=-0.03)]),
    case("onset_bias_2", "onset", [during(55.0, None, "winch_force_bias", 2, bias=120.0)]),
    case("onset_coulomb_1", "onset", [_friction(60.0, None, 1, 220.0)]),
    case(
        "onset_coulomb_4_grows",
        "onset",
        [_friction(None, 45.0, 4, 90.0), _friction(45.0, None, 4, 260.0)],
    ),
    case(
        "onset_wind_ends",
        "onset",
        [during(None, 35.0, "steady_wind", force_x=60.0, force_y=-40.0, torque=0.0)],
    ),
    case("onset_mass", "onset", [during(48.0, None, "platform_mass", mass=150.0)]),
    case(
        "onset_viscous_all",
        "onset",
        [during(30.0, None, "winch_viscous_friction", coefficient=400.0)],
    ),
    case("onset_anchor_2", "onset", [during(52.0, None, "anchor_offset", 2, x=0.08, y=-0.05)]),
    case(
        "onset_gain_1_for_a_while",
        "onset",
        [during(30.0, 55.0, "winch_force_gain", 1, factor=0.03)],
    ),
    case(
        "onset_drag_and_gain",
        "onset",
        [
            effect("platform_linear_drag", coefficient=90.0),
            during(42.0, None, "winch_force_gain", 2, factor=0.025),
        ],
    ),
]
