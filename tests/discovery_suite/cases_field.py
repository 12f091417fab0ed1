"""The suite's effects, and nothing at all, in recordings with imperfections drawn at random.

A field case is a case of the suite whose recordings have imperfections as well: each kind is there
with a chance of `SHARE`, of a size between two bounds (logarithmic). The draw is made from the
case's name, so that nobody chooses it. They stand beside the suite, and are run with `--field` or
by name (`--case`); the score has measures of its own for them.
"""

import zlib
from dataclasses import replace

import numpy as np

from .cases import case
from .cases_pair import PAIRS, TRIPLES
from .cases_single import SINGLES
from .imperfections import Imperfections

#: Chance that a kind of imperfection is there.
SHARE = 0.4
#: Smallest and largest size of each kind (m, N, s).
SIZES = {
    "pose_colour": (1e-3, 1e-2),
    "length_colour": (1e-3, 6e-3),
    "jitter": (5e-4, 4e-3),
    "pose_late": (5e-3, 0.05),
    "lengths_late": (5e-3, 0.05),
    "force_noise": (5.0, 80.0),
    "pose_drift": (2e-3, 2e-2),
    "pose_count": (1e-3, 1e-2),
    "length_count": (1e-3, 1e-2),
}
#: Shortest and longest time constant of noise with memory (s).
MEMORY = (0.1, 2.0)
#: Cases with nothing hidden.
NULLS = 60


def drawn(name):
    """The imperfections of the case of this name; the same in all its trials."""
    rng = np.random.default_rng(zlib.crc32(name.encode()))
    sizes = {}
    for kind, (least, most) in SIZES.items():
        there, share = rng.random() < SHARE, rng.random()
        if there:
            sizes[kind] = float(least * (most / least) ** share)
    least, most = MEMORY
    for memory in ("pose_memory", "length_memory"):
        sizes[memory] = float(least * (most / least) ** rng.random())
    # Clocks are late against each other: one of the two.
    if "pose_late" in sizes:
        sizes.pop("lengths_late", None)
    return Imperfections(**sizes)


def field(of):
    """The field case of a case of the suite."""
    name = f"field_{of.name}"
    it = drawn(name)

    def marred(settings):
        return settings.but(imperfections=it)

    # A late pose is the catalogue's own name for it.
    acceptable = ("pose_sensor_delay",) if it.pose_late else ()
    trials = {"train": tuple(map(marred, of.train)), "holdout": marred(of.holdout)}
    return replace(of, name=name, acceptable=acceptable, **trials)


FIELD = [field(case(f"null_{k:02d}", "null", [])) for k in range(NULLS)]
FIELD += [field(of) for of in (*SINGLES, *PAIRS, *TRIPLES)]
