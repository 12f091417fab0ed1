"""The suite's effects, and nothing at all, on a robot whose geometry is not quite as given.

All anchors and attachments are off by some centimetres, drawn from the case's name, so that nobody
chooses them. They are errors of the survey and no causes: a good answer has the effects alone. The
cases stand beside the suite, and are run by name (`--case`).
"""

import zlib
from dataclasses import replace

import numpy as np

from .cases import case, effect
from .cases_pair import PAIRS
from .cases_single import SINGLES

#: Standard deviation of each coordinate (m): of anchors, and of attachments.
ANCHORS, ATTACHMENTS = 0.05, 0.01
#: Cases with nothing hidden.
NULLS = 4


def errors(name, cables):
    """The errors of the survey of the case of this name; the same in all its trials."""
    rng = np.random.default_rng(zlib.crc32(name.encode()))
    out = []
    for cable in range(1, cables + 1):
        for kind, size in (("anchor_offset", ANCHORS), ("attachment_offset", ATTACHMENTS)):
            x, y = rng.normal(0.0, size, 2)
            out.append(effect(kind, cable, x=float(x), y=float(y)))
    return tuple(out)


def off(of):
    """The case of the suite on a robot that is off."""
    name = f"geometry_{of.name}"
    return replace(of, name=name, survey=errors(name, of.holdout.robot.cables))


_ARE_GEOMETRY = {"anchor_offset", "attachment_offset", "length_sensor_bias", "pose_sensor_bias"}


def _beside(of):
    return not any(item["id"] in _ARE_GEOMETRY for item in of.effects)


GEOMETRY = [off(case(f"null_{k}", "null", [])) for k in range(NULLS)]
GEOMETRY += [off(of) for of in (*SINGLES, *PAIRS) if _beside(of)]
