"""The declared suite: which effect is hidden in which trial.

Every case has a fixed seed made from its name. Sizes are typical of real machines and, unless a
case says otherwise, plainly visible against the noise (see `strength`).
"""

import zlib
from dataclasses import dataclass

from .robot import TELESCOPE
from .trial import Settings


@dataclass(frozen=True)
class Case:
    """One case: what is hidden, in which trials, and what a good answer is.

    `ambiguous` is "no" (the data tell), "allowed" (naming is right, an honest list is right too) or
    "expected" (the data cannot tell: an exact name would be luck). `alternatives` lists the ids
    that a correct `ambiguous` answer may hold beside the truth.
    """

    name: str
    group: str
    effects: tuple
    train: tuple
    holdout: Settings
    model: str = "lumped_mass"  # cable model that the workflow starts from
    data_model: str = "lumped_mass"  # cable model of the plant that made the data
    ambiguous: str = "no"
    alternatives: tuple = ()
    rivals: tuple = ()  # (rival effect, its free parameters), for `measure`
    acceptable: tuple = ()  # ids that may be named though none is hidden (a model-form error)
    survey: tuple = ()  # errors of the geometry: in the data, and no cause
    note: str = ""

    def toml(self):
        """The model file that the workflow starts from; the telescope's robot is the default."""
        robot = self.holdout.robot
        known = "" if robot is TELESCOPE else robot.toml()
        return f'cable_model = "{self.model}"\n' + known


def effect(kind, cable=None, law=None, compare=None, extra=None, **values):
    """One hidden effect; `compare` are the parameters whose truth means the same in the catalogue.

    With another smoothing of a friction law its transition speed has no counterpart, so only the
    levels are compared.
    """
    made = {"id": kind, "cable": cable, "parameters": values, **(extra or {})}
    if law is not None:
        made["law"] = law
    if compare is None:
        compare = [name for name in values if law in (None, "tanh") or name != "transition_speed"]
    made["compare"] = list(compare)
    made["form"] = "other" if law not in (None, "tanh") else "same"
    return made


def outside(law, cable=None, **values):
    """A law outside the catalogue."""
    return effect("outside", cable, law=law, compare=(), **values)


def seed(name, trial):
    """A fixed seed for trial number `trial` of a case."""
    return zlib.crc32(f"{name}/{trial}".encode())


# Trials of a case: the second differs from the first in pretension and place, as an experimenter
# who wants to tell look-alikes apart would arrange it; the hold-out lies between.
def standard(name, second_pretension=None, holdout_pretension=None, **changes):
    """Two training trials of 100 s and a hold-out of 80 s at 50 Hz, with these settings changed."""
    first = Settings(seed=seed(name, 1), lead_in=12.0).but(**changes)
    second = first.but(
        seed=seed(name, 2),
        pretension=second_pretension or 0.65 * first.pretension,
        pretension_swing=0.1 * first.pretension,
        centre=(12.0, -8.0, 0.03),
    )
    holdout = first.but(
        seed=seed(name, 3),
        pretension=holdout_pretension or 0.85 * first.pretension,
        pretension_swing=0.05 * first.pretension,
        centre=(-5.0, 4.0, -0.02),
        duration=80.0,
    )
    return (first, second), holdout


def local(name, **changes):
    """Two training trials and a hold-out around the centre, for laws that grow with distance."""
    (first, second), holdout = standard(name, **changes)
    return (first, second.but(centre=(0.5, -0.5, 0.03))), holdout.but(centre=(-0.5, 0.5, -0.02))


def single_trial(name, **changes):
    """One training trial and a hold-out alike, at one pretension and place."""
    first = Settings(seed=seed(name, 1), lead_in=12.0).but(**changes)
    return (first,), first.but(seed=seed(name, 3), duration=0.8 * first.duration)


def case(name, group, effects, trials=None, **changes):
    """A case on standard trials; `changes` go to its own field of that name, else to the trials."""
    own = {key: changes.pop(key) for key in list(changes) if key in Case.__dataclass_fields__}
    train, holdout = (trials or standard)(name, **changes)
    return Case(name, group, tuple(effects), train, holdout, **own)
