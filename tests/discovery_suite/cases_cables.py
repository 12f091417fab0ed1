"""Other numbers of cables, and other sizes of robots: three, six and eight, of 100, 4 and 900 m."""

from .cases import case, effect, seed
from .robot import BENCH, EIGHT, FIELD
from .trial import Settings


def _alike(first, name, **second):
    """A second training trial elsewhere and a hold-out between."""
    shift = tuple(0.5 * value for value in second["centre"])
    holdout = first.but(seed=seed(name, 3), duration=0.8 * first.duration, centre=shift)
    return (first, first.but(seed=seed(name, 2), **second)), holdout


def on_field(name, **changes):
    """Trials of the robot with three cables over a field."""
    first = Settings(
        seed=seed(name, 1),
        robot=FIELD,
        duration=60.0,
        amplitude=2.0,
        rotation=0.05,
        slowest=0.03,
        fastest=0.4,
        lead_in=12.0,
        loop=(1.5, 0.8, 12.0),
        pose_noise=2e-3,
        angle_noise=5e-4,
        length_noise=1e-3,
        tension_noise=2.0,
    ).but(**changes)
    return _alike(first, name, centre=(1.5, -1.0, 0.02))


def on_bench(name, **changes):
    """Trials of the robot with six cables on a bench."""
    first = Settings(
        seed=seed(name, 1),
        robot=BENCH,
        duration=20.0,
        rate=100.0,
        pretension=200.0,
        pretension_swing=20.0,
        amplitude=0.15,
        rotation=0.08,
        slowest=0.1,
        fastest=1.2,
        settling=2.0,
        tones=((2.0, 20.0), (0.2, 0.7)),
        lead_in=3.0,
        loop=(9.0, 0.8, 40.0),
        pose_noise=2e-4,
        angle_noise=2e-4,
        length_noise=2e-4,
        tension_noise=0.2,
    ).but(**changes)
    return _alike(first, name, pretension=130.0, centre=(0.1, -0.08, 0.03))


def on_frame(name, **changes):
    """Trials of the robot with eight cables on a large frame."""
    first = Settings(seed=seed(name, 1), robot=EIGHT, duration=60.0, rate=25.0, lead_in=12.0).but(
        **changes
    )
    return _alike(first, name, pretension=13e3, pretension_swing=2e3, centre=(12.0, -8.0, 0.03))


def _coulomb(cable, force, transition_speed):
    values = {"force": force, "transition_speed": transition_speed}
    return effect("winch_coulomb_friction", cable, law="tanh", **values)


CABLES = [
    case("three_null", "null", [], on_field),
    case("three_coulomb_2", "single", [_coulomb(2, 30.0, 0.02)], on_field),
    case("three_mass", "single", [effect("platform_mass", mass=15.0)], on_field),
    case(
        "three_drag_gain",
        "pair",
        [
            effect("platform_linear_drag", coefficient=25.0),
            effect("winch_force_gain", 1, factor=0.01),
        ],
        on_field,
    ),
    case("six_null", "null", [], on_bench),
    case("six_coulomb_5", "single", [_coulomb(5, 3.0, 0.01)], on_bench),
    case("six_mass", "single", [effect("platform_mass", mass=0.6)], on_bench),
    case(
        "six_drag_coulomb_2",
        "pair",
        [effect("platform_linear_drag", coefficient=6.0), _coulomb(2, 4.0, 0.02)],
        on_bench,
    ),
    case("eight_null", "null", [], on_frame),
    case("eight_coulomb_7", "single", [_coulomb(7, 200.0, 0.02)], on_frame),
    case("eight_drag", "single", [effect("platform_linear_drag", coefficient=60.0)], on_frame),
    case(
        "eight_mass_bias_3",
        "pair",
        [effect("platform_mass", mass=120.0), effect("winch_force_bias", 3, bias=80.0)],
        on_frame,
    ),
]
