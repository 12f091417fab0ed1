"""The whole suite in one list, and its small subset."""

from dataclasses import replace

from .cases_cables import CABLES
from .cases_field import BENCH, CHANCE, FIELD
from .cases_geometry import GEOMETRY
from .cases_hard import ELASTICITY, LOOK_ALIKES, MOORDYN, NEAR_THRESHOLD, NULLS, OUTSIDE_CASES
from .cases_machine import GUSTS, MACHINE
from .cases_onset import ONSET
from .cases_pair import PAIRS, TRIPLES
from .cases_realistic import REALISTIC
from .cases_single import SINGLES
from .cases_unlike import UNLIKE

SUITE = [
    *SINGLES,
    *PAIRS,
    *TRIPLES,
    *NEAR_THRESHOLD,
    *LOOK_ALIKES,
    *OUTSIDE_CASES,
    *ELASTICITY,
    *MOORDYN,
    *NULLS,
]
_ALL = [
    *SUITE,
    *REALISTIC,
    *FIELD,
    *BENCH,
    *CHANCE,
    *CABLES,
    *MACHINE,
    *GUSTS,
    *ONSET,
    *GEOMETRY,
    *UNLIKE,
]
_BY_NAME = {case.name: case for case in _ALL}
if len(_BY_NAME) != len(_ALL):
    raise ValueError("the suite holds two cases of one name")


#: Whole sets of cases that stand beside the suite.
SETS = {"field": FIELD, "chance": CHANCE}


def select(names=None, small=False, redraw=0, beside=None):
    """The cases of these names, the small subset, the set `beside` the suite, or the suite.

    With `redraw` the same effects are hidden in other trials: all seeds move by that much, so
    paths, wind, noise, gaps and outliers are others.
    """
    return [
        _redrawn(case, redraw) for case in (SETS[beside] if beside else _selected(names, small))
    ]


def _redrawn(case, by):
    def moved(settings):
        return settings.but(seed=settings.seed + by)

    return replace(case, train=tuple(map(moved, case.train)), holdout=moved(case.holdout))


def _selected(names, small):
    if small:
        names = SMALL
    if not names:
        return SUITE
    unknown = sorted(set(names) - set(_BY_NAME))
    if unknown:
        raise ValueError(f"unknown case {unknown[0]!r}; known: {', '.join(sorted(_BY_NAME))}")
    return [_BY_NAME[name] for name in names]


# Two singles, a pair, a null, one outside the catalogue, the paper's own story, one that begins
# while the robot moves, and one each of three, six and eight cables.
SMALL = (
    "quadratic_drag",
    "coulomb_1_tanh",
    "mass_and_rotational_damping",
    "null_00",
    "outside_skew_stiffness",
    "elasticity_plain",
    "onset_wind_ends",
    "three_drag_gain",
    "six_mass",
    "eight_mass_bias_3",
)
