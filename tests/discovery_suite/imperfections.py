"""What machines do to a recording beside white noise, and the cases that have it.

Imperfections act on what is written to the file, after the trial has been run: the robot and its
controller know nothing of them. Each is drawn from a stream of its own, so that a trial with an
imperfection is the trial without it in everything else.
"""

from dataclasses import asdict, dataclass

import numpy as np
from scipy.interpolate import CubicSpline
from scipy.signal import lfilter

#: The angle's errors (rad) for each metre of those of the position, as with white noise (1/m): of
#: the telescope, whose attachments are some ten metres off.
ANGLE = 1e-2


@dataclass(frozen=True)
class Imperfections:
    """Sizes of what is not white noise; zero is not there. Lengths m, forces N, times s."""

    pose_colour: float = 0.0  # rms of first-order noise on x and y (phi: times `angle`)
    pose_memory: float = 0.4  # its time constant
    length_colour: float = 0.0  # the same on the lengths
    length_memory: float = 0.4
    jitter: float = 0.0  # rms error of the time stamps
    pose_late: float = 0.0  # delay of the pose against its stamp
    lengths_late: float = 0.0  # delay of the lengths
    force_noise: float = 0.0  # rms white error of each recorded winch force
    pose_drift: float = 0.0  # rms of a slow wander of x and y (phi: times `angle`)
    pose_count: float = 0.0  # resolution of x and y (phi: times `angle`)
    length_count: float = 0.0  # resolution of the lengths
    angle: float = ANGLE


#: White noise alone.
NONE = Imperfections()


def sizes(it):
    """What is there, by name; nothing where the noise is white."""
    if it == NONE:
        return {}
    there = {name: size for name, size in asdict(it).items() if size and name != "angle"}
    # A time constant says something only beside its noise.
    for kind in ("pose", "length"):
        if f"{kind}_colour" not in there:
            there.pop(f"{kind}_memory", None)
    return there


@dataclass
class Written:
    """What goes to the file: stamps (n), recorded winch forces (n, 4) and the readings."""

    time: np.ndarray
    forces: np.ndarray
    columns: dict


def gauss_markov(rng, n, dt, rms, memory):
    """Stationary first-order noise of this size and time constant, (n,)."""
    decay = np.exp(-dt / memory)
    white = rms * np.sqrt(1.0 - decay**2) * rng.standard_normal(n)
    white[0] /= np.sqrt(1.0 - decay**2)
    return lfilter([1.0], [1.0, -decay], white)


def wander(rng, n, rms):
    """A smooth wander over the whole trial, three slow waves, beginning at zero, (n,)."""
    t = np.linspace(0.0, 1.0, n)
    wave = sum(
        rng.standard_normal() * np.sin(np.pi * k * t) / k
        + rng.standard_normal() * (np.cos(np.pi * k * t) - 1.0) / k
        for k in (1, 2, 3)
    )
    return rms * wave / max(np.sqrt(np.mean(wave**2)), 1e-12)


def apply(record, it):
    """What is `Written` of a record with these imperfections."""
    n = len(record.states)
    stamps, colours, forces, drifts = map(
        np.random.default_rng, np.random.SeedSequence([record.settings.seed, 4]).spawn(4)
    )
    true_time = record.dt * np.arange(n)
    time = true_time + it.jitter * np.clip(stamps.standard_normal(n), -2.4, 2.4)
    time[0] = 0.0
    columns = {}
    for name, readings in record.columns.items():
        pose = name in ("x", "y", "phi")
        length = "length" in name
        share = it.angle if name == "phi" else 1.0
        errors = readings - record.clean[name]
        late = it.pose_late if pose else (it.lengths_late if length else 0.0)
        shown = record.clean[name]
        if late:
            shown = CubicSpline(true_time, shown)(np.maximum(true_time - late, 0.0))
        values = shown + errors
        colour, memory = (
            (it.pose_colour, it.pose_memory) if pose else (it.length_colour, it.length_memory)
        )
        if (pose or length) and colour:
            values = values + gauss_markov(colours, n, record.dt, share * colour, memory)
        if pose and it.pose_drift:
            values = values + wander(drifts, n, share * it.pose_drift)
        count = share * (it.pose_count if pose else (it.length_count if length else 0.0))
        columns[name] = count * np.round(values / count) if count else values
    noise = it.force_noise * forces.standard_normal(record.forces.shape)
    return Written(time, record.forces + noise, columns)
