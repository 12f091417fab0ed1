"""The suite's effects, and nothing at all, in recordings with imperfections drawn at random.

A field case is a case of the suite whose recordings have imperfections as well: each kind is there
with a chance of `SHARE`, of a size between two bounds (logarithmic). The draw is made from the
case's name, so that nobody chooses it. They stand beside the suite, and are run with `--field`, the
short ones with nothing hidden by which the test against chance is judged with `--chance`, or
by name (`--case`); the score has measures of its own for them.
"""

import zlib
from dataclasses import replace

import numpy as np

from .cases import case, standard
from .cases_bench import LAWS_ON_BENCH
from .cases_cables import CABLES, on_bench
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
#: The same in short recordings, by which the test against chance is judged.
BRIEF_NULLS = 200


#: The same for the bench of 4 m: what its sensors do, and forces of some 200 N with errors of up to
#: 2 %.
BENCH_SIZES = {
    "pose_colour": (1e-4, 1e-3),
    "length_colour": (1e-4, 1e-3),
    "jitter": (2e-4, 2e-3),
    "pose_late": (2e-3, 0.03),
    "lengths_late": (2e-3, 0.03),
    "force_noise": (0.3, 4.0),
    "pose_drift": (2e-4, 2e-3),
    "pose_count": (1e-4, 1e-3),
    "length_count": (1e-4, 1e-3),
}
#: The bench's attachments are 0.2 m off: its angle's errors for each metre (1/m).
BENCH_ANGLE = 2.0


def drawn(name, kinds=SIZES, **further):
    """The imperfections of the case of this name; the same in all its trials."""
    rng = np.random.default_rng(zlib.crc32(name.encode()))
    sizes = dict(further)
    for kind, (least, most) in kinds.items():
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


def field(of, prefix="field", kinds=SIZES, **further):
    """The field case of a case of the suite."""
    name = f"{prefix}_{of.name}"
    it = drawn(name, kinds, **further)

    def marred(settings):
        return settings.but(imperfections=it)

    # A late pose is the catalogue's own name for it.
    acceptable = ("pose_sensor_delay",) if it.pose_late else ()
    trials = {"train": tuple(map(marred, of.train)), "holdout": marred(of.holdout)}
    return replace(of, name=name, acceptable=acceptable, **trials)


def brief(name):
    """Two training trials of 40 s and a hold-out of 30 s at 25 Hz: a search of some seconds."""
    train, holdout = standard(name, rate=25.0, duration=40.0)
    return train, holdout.but(duration=30.0)


FIELD = [field(case(f"null_{k:02d}", "null", [])) for k in range(NULLS)]
FIELD += [field(of) for of in (*SINGLES, *PAIRS, *TRIPLES)]

#: Nothing hidden, many times: how often chance explains as much as the best candidate.
CHANCE = [case(f"null_{k:03d}", "null", [], brief) for k in range(BRIEF_NULLS)]
CHANCE = [field(of, "chance") for of in CHANCE]

#: The same on a bench of 4 m with six cables, run by name.
BENCH = [case(f"null_{k:02d}", "null", [], on_bench) for k in range(10)]
BENCH += [of for of in CABLES if of.name.startswith("six_") and of.name != "six_null"]
BENCH += LAWS_ON_BENCH
BENCH = [field(of, "bench", BENCH_SIZES, angle=BENCH_ANGLE) for of in BENCH]
