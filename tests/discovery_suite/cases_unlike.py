"""One law on all winches, of another size on each: winches that wear, cells off by their own share.

They stand beside the suite, and are run by name (`--case`).
"""

from .cases import case, effect
from .cases_cables import on_bench
from .cases_field import BENCH_ANGLE, BENCH_SIZES, field


def _coulomb(cable, force):
    return effect("winch_coulomb_friction", cable, law="tanh", force=force, transition_speed=0.01)


def _each(make, *sizes):
    return [make(cable, size) for cable, size in enumerate(sizes, 1)]


_UNLIKE = [
    case("unlike_coulomb", "unlike", _each(_coulomb, 80.0, 140.0, 110.0, 190.0)),
    case("unlike_coulomb_two", "unlike", [_coulomb(2, 110.0), _coulomb(4, 160.0)]),
    case(
        "unlike_viscous",
        "unlike",
        _each(
            lambda cable, size: effect("winch_viscous_friction", cable, coefficient=size),
            150.0,
            90.0,
            240.0,
            120.0,
        ),
    ),
    case(
        "unlike_capstan",
        "unlike",
        _each(
            lambda cable, size: effect(
                "pulley_capstan_loss", cable, loss=size, extra={"smoothing_speed": 0.005}
            ),
            0.004,
            0.009,
            0.006,
            0.012,
        ),
    ),
    case(
        "unlike_gain",
        "unlike",
        _each(
            lambda cable, size: effect("winch_force_gain", cable, factor=size),
            0.008,
            -0.006,
            0.004,
            -0.01,
        ),
    ),
]

_ON_BENCH = [
    case(
        "unlike_coulomb_six",
        "unlike",
        _each(
            lambda cable, size: effect(
                "winch_coulomb_friction", cable, law="tanh", force=size, transition_speed=0.005
            ),
            2.0,
            3.5,
            1.5,
            4.0,
            2.5,
            3.0,
        ),
        on_bench,
    ),
]

UNLIKE = [
    *_UNLIKE,
    *(field(of) for of in _UNLIKE),
    *_ON_BENCH,
    *(field(of, "bench", BENCH_SIZES, angle=BENCH_ANGLE) for of in _ON_BENCH),
]
