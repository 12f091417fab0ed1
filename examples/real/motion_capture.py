"""Run as: python examples/real/motion_capture.py TAKE LOG --out capture

Turns a take of motion capture of the four-cable robot in `gchenfc/cable-robot` and the robot's own
log of that day (September 2021) into a recording and a model for `cdpr calibrate`.

The take (120 Hz) has the platform, a rectangle of four markers, and markers at the corners of the
frame. The log (a row each 10 ms) has paid-out lengths to 0.1 mm (with a minus), and no torques.
What is kept, at the log's times:

- `x`, `y`, the platform's middle in the plane of the frame, from the frame's middle;
- `phi`, its turn in that plane from the middle one, in which its sides are level; a few frames in
  which the take exchanges markers are left out;
- lengths, as `cable_length[i]`.

The two clocks differ by an offset: the one by which the position that the controller computed
follows the measured one best.
"""

import argparse
import re
import sys
from pathlib import Path

import numpy as np

CABLES = 4
INTERVAL = 0.01  # s, the period of the log
PLATFORM = "Rigid Body 2"
# Where cables are fixed (m) from the platform's middle: its markers are 131.5 mm by 120 mm apart,
# and the cables leave 26 mm further out on both sides.
ATTACHED = (0.1315 / 2 + 0.026, 0.120 / 2)
TURNED = 0.05  # rad from the frames around; a frame that is further off has markers exchanged
OFFSETS = np.arange(-20.0, 20.0, 0.01)  # s between the clocks that are tried


def read_log(path):
    """Computed positions and lengths; a `ValueError` names the file and what was expected."""
    rows = []
    for line in path.read_text(encoding="utf-8", errors="replace").splitlines():
        numbers = [float(v) for v in re.findall(r"-?\d+\.\d+", line)]
        if len(numbers) == 2 * 2 + 2 * CABLES:  # position, asked position; length and speed each
            rows.append(numbers)
    if not rows:
        raise ValueError(f"{path}: no row of a log; expected position, asked one, lengths, speeds")
    table = np.array(rows)
    return table[:, :2], -table[:, 4::2]


def read_take(path):
    """Times, names, kinds and axes of the columns, and the numbers."""
    lines = path.read_text(encoding="utf-8").splitlines()
    start = next((k for k, line in enumerate(lines) if line.startswith("Frame,Time")), None)
    if start is None or start < 3:
        raise ValueError(f"{path}: no line `Frame,Time,...`; expected an exported take")
    names, kinds, axes = (lines[start - k].split(",") for k in (3, 1, 0))
    table = np.genfromtxt(lines[start + 1 :], delimiter=",")
    return table[:, 1], names, kinds, axes, table


def columns(take, name, kind, wanted):
    """The columns of a body or marker, one for each axis."""
    _, names, kinds, axes, table = take
    found = [
        next(
            (k for k in range(len(names)) if (names[k], kinds[k], axes[k]) == (name, kind, a)), None
        )
        for a in wanted
    ]
    if None in found:
        raise ValueError(f"the take has no {kind.lower()} of {name!r} along all of {wanted}")
    return table[:, found]


def corners(take):
    """The frame's corners right below, right above, left above, left below, in the take's axes."""
    names = sorted({name for name in take[1] if name.startswith("Marker_")})
    if len(names) != CABLES:
        raise ValueError(f"the take has {len(names)} markers of its own, expected {CABLES} corners")
    found = np.array([np.nanmean(columns(take, n, "Position", "XYZ"), axis=0) for n in names])
    above, right = (found[:, axis] > found[:, axis].mean() for axis in (1, 2))
    order = [right & ~above, right & above, ~right & above, ~right & ~above]
    if not all(corner.any() for corner in order):
        raise ValueError("the markers of the take are not at four corners in its plane of y and z")
    return np.array([found[np.flatnonzero(corner)[0]] for corner in order])


def poses(take):
    """Measured x, y and phi, gaps where markers are exchanged, and the frame's width and height."""
    right_below, right_above, left_above, left_below = corners(take)
    along = right_below - left_below
    along /= np.linalg.norm(along)
    up = left_above - left_below
    up -= (up @ along) * along
    up /= np.linalg.norm(up)
    middle = np.mean([right_below, right_above, left_above, left_below], axis=0)
    position = columns(take, PLATFORM, "Position", "XYZ") - middle
    # The axis across the plane is the take's x; about it the platform turns.
    quaternion = columns(take, PLATFORM, "Rotation", "XYZW")
    turn = -2 * np.arctan2(quaternion[:, 0], quaternion[:, 3])
    turn = np.mod(turn + np.pi / 2, np.pi) - np.pi / 2
    turn -= np.nanmedian(turn)
    pose = np.column_stack([position @ along, position @ up, turn])
    around = [np.nanmedian(turn[max(k - 15, 0) : k + 16]) for k in range(len(turn))]
    pose[np.abs(turn - around) > TURNED] = np.nan
    size = np.linalg.norm(right_below - left_below), np.linalg.norm(left_above - left_below)
    return pose, size


def offset(times, pose, computed):
    """By how much (s) the take's clock is ahead of the log's."""
    own = INTERVAL * np.arange(len(computed))
    there = np.isfinite(pose[:, 0])

    def apart(shift):
        moved = [np.interp(own + shift, times[there], pose[there, axis]) for axis in (0, 1)]
        return np.sum(np.square(np.diff(np.array(moved).T - computed, axis=0)))

    return min(OFFSETS, key=apart)


def model(width, height):
    """The robot by its frame's markers and its platform's size."""
    lines = [
        "# The frame and the platform as they were measured; the mass as the firmware has it.",
        'cable_model = "rigid"',
        'cable_inertia = "none"',
        "platform_mass = 0.5",
        "platform_inertia = 0.005",
        "gravity = [0.0, -9.81]",
    ]
    for x, y in [(1, -1), (1, 1), (-1, 1), (-1, -1)]:
        lines += [
            "",
            "[[cable]]",
            f"anchor = [{x * width / 2:.4f}, {y * height / 2:.4f}]",
            f"attachment = [{x * ATTACHED[0]:.4f}, {y * ATTACHED[1]:.4f}]",
        ]
    return "\n".join(lines) + "\n"


def main():
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[2])
    parser.add_argument("take", type=Path, metavar="TAKE")
    parser.add_argument("log", type=Path, metavar="LOG")
    parser.add_argument("--out", type=Path, required=True, metavar="DIR")
    arguments = parser.parse_args()
    computed, lengths = read_log(arguments.log)
    take = read_take(arguments.take)
    try:
        pose, size = poses(take)
    except ValueError as error:
        raise ValueError(f"{arguments.take}: {error}") from error
    times = take[0]
    shift = offset(times, pose, computed)
    own = INTERVAL * np.arange(len(lengths))
    nearest = np.searchsorted(times, own + shift).clip(1, len(times) - 1)
    measured = np.column_stack([np.interp(own + shift, times, pose[:, axis]) for axis in range(3)])
    # Of a gap nothing is known, nor outside the take.
    known = np.isfinite(pose[nearest - 1, 0]) & np.isfinite(pose[nearest, 0])
    known &= (own + shift > times[0]) & (own + shift < times[-1])
    measured[~known] = np.nan
    rows = np.flatnonzero(known)
    if not len(rows):
        raise ValueError(f"{arguments.log}: no row at the time of {arguments.take}")
    rows = slice(rows[0], rows[-1] + 1)
    table = np.column_stack([own, measured, lengths])[rows]
    header = ",".join(["time", "x", "y", "phi", *(f"cable_length[{i}]" for i in range(1, 5))])
    arguments.out.mkdir(parents=True, exist_ok=True)
    name = arguments.take.stem
    path = arguments.out / f"{name}.csv"
    np.savetxt(path, table, delimiter=",", header=header, comments="", fmt="%.6g")
    (arguments.out / f"{name}.toml").write_text(model(*size), encoding="utf-8")
    print(f"{name}: {len(table)} rows, the take's clock {shift:.2f} s ahead of the log's")


if __name__ == "__main__":
    try:
        main()
    except (OSError, ValueError) as error:
        sys.exit(f"motion_capture.py: {error}")
