"""Recordings as machines make them: every imperfection alone and all together, with nothing hidden
and with one effect. They stand beside the suite, and are run by name (`--case`)."""

from .cases import case, effect
from .imperfections import Imperfections

IMPERFECT = {
    "pose_memory": Imperfections(pose_colour=5e-3, pose_memory=0.4),
    "length_memory": Imperfections(length_colour=3e-3, length_memory=0.4),
    "jitter": Imperfections(jitter=4e-3),
    "pose_late": Imperfections(pose_late=0.02),
    "lengths_late": Imperfections(lengths_late=0.02),
    "force_noise": Imperfections(force_noise=50.0),
    "drift": Imperfections(pose_drift=0.01),
    "counts": Imperfections(pose_count=0.01, length_count=5e-3),
}
IMPERFECT["all"] = Imperfections(
    pose_colour=5e-3,
    length_colour=3e-3,
    jitter=4e-3,
    lengths_late=0.02,
    force_noise=50.0,
    pose_drift=0.01,
    pose_count=1e-3,
    length_count=1e-3,
)

HIDDEN = {
    "drag": [effect("platform_linear_drag", coefficient=60.0)],
    "coulomb": [
        effect("winch_coulomb_friction", 2, law="tanh", force=150.0, transition_speed=0.02)
    ],
    "gain": [effect("winch_force_gain", 3, factor=0.02)],
    "mass": [effect("platform_mass", mass=120.0)],
}


def realistic(name, group, effects, kind):
    """A case on standard trials with one kind of imperfection."""
    # A late pose is the catalogue's own name for it.
    acceptable = ("pose_sensor_delay",) if kind == "pose_late" else ()
    return case(name, group, effects, imperfections=IMPERFECT[kind], acceptable=acceptable)


REALISTIC = [realistic(f"realistic_null_{kind}", "null", [], kind) for kind in IMPERFECT]
REALISTIC += [
    realistic(f"realistic_{hidden}_{kind}", "single", effects, kind)
    for kind in IMPERFECT
    for hidden, effects in HIDDEN.items()
]
