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

    Names choose among all cases, or within the set `beside` the suite or the small subset. With
    `redraw` the same effects are hidden in other trials: all seeds move by that much, so paths,
    wind, noise, gaps and outliers are others. The small subset has recordings of 60 s.
    """
    cases = _chosen(names, small, beside)
    return [_redrawn(_shortened(case) if small else case, redraw) for case in cases]


def _redrawn(case, by):
    return _changed(case, lambda settings: settings.but(seed=settings.seed + by))


def _shortened(case):
    return _changed(case, lambda settings: settings.but(duration=min(settings.duration, SHORT)))


def _changed(case, change):
    return replace(case, train=tuple(map(change, case.train)), holdout=change(case.holdout))


def _chosen(names, small, beside):
    if beside:
        among = SETS[beside]
    elif small:
        among = [_BY_NAME[name] for name in SMALL]
    else:
        among = _ALL if names else SUITE
    if not names:
        return among
    by_name = {case.name: case for case in among}
    unknown = sorted(set(names) - set(by_name))
    if unknown:
        raise ValueError(f"unknown case {unknown[0]!r}; known: {', '.join(sorted(by_name))}")
    return [by_name[name] for name in names]


# Length of the recordings of the small subset (s).
SHORT = 60.0

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
