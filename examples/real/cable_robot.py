"""Run as: python examples/real/cable_robot.py LOG [LOG ...] --out cable-robot

Turns logs of the four-cable robot in `gchenfc/cable-robot` into recordings and models for `cdpr`.

A log has no time stamps and prints a row every 50 ms: state of the drives, paid-out lengths to
1 cm (with a minus), speeds of the drums to 0.01 turn/s, torques of the motors to 0.01 N m, and the
position that the controller computed from cables 1 and 4. The logs of February 2021 have lines
`Traj:` in between, one for each step of the controller (some 11 ms), with the four tensions that
it asked for. What is kept of it:

- lengths, as `cable_length[i]`;
- forces, torque over drum radius, as `winch_force[i]`. A recording holds its forces until the next
  row, so it is the mean of the `Traj:` lines up to there, and where there are none, of the row and
  the next one (in the logs that have them, 0.3 to 0.6 as far off as the row's own);
- time, the number of the row times the period by which speeds add up to lengths.

The position is left out, because nobody measured it: it is the lengths of cables 1 and 4 once more.
"""

import argparse
import re
import sys
from dataclasses import dataclass
from pathlib import Path

import numpy as np

CABLES = 4
DRUM_RADIUS = 0.0127  # m, the firmware's r = 0.0254/2
ROTOR_INERTIA = 1.96e-4  # kg m2, README of folder gerry08_iLQR_t4/data
PLATFORM_MASS = 0.5  # kg, the same
# Width and height of the frame (m) by the firmware of the day; cables 1 to 4 go to the corners
# right below, right above, left above, left below.
FRAMES = {"Feb": (2.95, 2.3), "Mar": (3.18, 2.42)}
SHORTEST = 200  # rows of a stretch under control
DRIVEN = 0.15  # N m; the controller asks 0.2 N m of each motor at least
FLOAT = re.compile(r"-?\d+(?:\.\d+)?")


@dataclass
class Log:
    """The rows of a log, or of a part of it."""

    length: np.ndarray  # m, paid out, rows by cables
    speed: np.ndarray  # m/s, paying out is positive
    torque: np.ndarray  # N m
    asked: list  # for each row the tensions (N) of the `Traj:` lines up to the next row

    def part(self, begin, end):
        """Rows from `begin` up to `end`."""
        rows = slice(begin, end)
        return Log(self.length[rows], self.speed[rows], self.torque[rows], self.asked[rows])


def read_log(path):
    """Reads a log; a `ValueError` names the file and what was expected."""
    rows, asked = [], []
    for line in path.read_text(encoding="utf-8", errors="replace").splitlines():
        if line.startswith("Traj:"):
            values = [float(v) for v in FLOAT.findall(line)]
            # Index, position, the desired one and its speed, force on the platform, four tensions.
            if rows and len(values) >= 5 + CABLES:
                asked[-1].append(values[-CABLES:])
            continue
        cells = re.split(r"[,\s]+", line.strip())
        if len(cells) < 22 or not re.fullmatch(r"[0-9A-F]+", cells[0]):
            continue  # a message, or a line cut off
        try:
            rows.append([float(v) for v in cells[2 * CABLES : 5 * CABLES]])
        except ValueError:
            continue
        asked.append([])
    if not rows:
        raise ValueError(
            f"{path}: no row of a log; expected status, state, lengths, speeds, torques"
        )
    table = np.array(rows)
    turn = 2 * np.pi * DRUM_RADIUS
    return Log(
        -table[:, :CABLES], -turn * table[:, CABLES : 2 * CABLES], table[:, 2 * CABLES :], asked
    )


def longest_run(log):
    """First row and end of the longest stretch in which all motors are driven."""
    driven = (log.torque.min(axis=1) > DRIVEN).astype(int)
    edges = np.flatnonzero(np.diff(np.r_[0, driven, 0]))
    begin, end = max(edges.reshape(-1, 2), key=lambda run: run[1] - run[0], default=(0, 0))
    return int(begin), int(end)


def period(log, over=20):
    """The time between rows (s) by which speeds add up to lengths over `over` rows."""
    way = np.cumsum((log.speed[1:] + log.speed[:-1]) / 2, axis=0)
    by_speed = (way[over:] - way[:-over]).ravel()
    by_length = (log.length[1 + over :] - log.length[1:-over]).ravel()
    return float(by_speed @ by_length / (by_speed @ by_speed))


def forces(log):
    """The winches' pulls (N), held from each row to the next."""
    pulls = log.torque / DRUM_RADIUS
    pulls[:-1] = 0.5 * (pulls[:-1] + pulls[1:])
    for row, asked in enumerate(log.asked):
        if asked:
            pulls[row] = np.mean(asked, axis=0)
    return pulls


def write_recording(path, log, interval):
    """Writes a recording as `docs/recordings.md` says."""
    names = [
        f"{what}[{i}]" for what in ("winch_force", "cable_length") for i in range(1, CABLES + 1)
    ]
    time = interval * np.arange(len(log.length))
    table = np.column_stack([time, forces(log), log.length])
    header = ",".join(["time", *names])
    np.savetxt(path, table, delimiter=",", header=header, comments="", fmt="%.6g")


def model(width, height):
    """The firmware's robot: a point on four cables, which hangs in an upright frame."""
    corners = [(width, 0), (width, height), (0, height), (0, 0)]
    lines = [
        "# The robot as its firmware has it: a point on four cables.",
        'cable_model = "rigid"',
        'cable_inertia = "none"',
        f"platform_mass = {PLATFORM_MASS}",
        "platform_inertia = 0.001  # no cable turns a point",
        "gravity = [0.0, -9.81]",
        "",
        "[winch]",
        f"drum_radius = {DRUM_RADIUS}",
        f"rotor_inertia = {ROTOR_INERTIA}",
    ]
    for x, y in corners:
        lines += [
            "",
            "[[cable]]",
            f"anchor = [{x - width / 2:.4f}, {y - height / 2:.4f}]",
            "attachment = [0.0, 0.0]",
        ]
    return "\n".join(lines) + "\n"


def frame_of(path):
    """Width and height (m) of the frame on the day of a log."""
    month = next((month for month in FRAMES if month in path.name), None)
    if month is None:
        known = ", ".join(FRAMES)
        raise ValueError(
            f"{path}: the frame's size is known by a month in the name, one of {known}"
        )
    return FRAMES[month]


def main():
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[2])
    parser.add_argument("logs", nargs="+", type=Path, metavar="LOG")
    parser.add_argument("--out", type=Path, required=True, metavar="DIR")
    arguments = parser.parse_args()
    arguments.out.mkdir(parents=True, exist_ok=True)
    for path in arguments.logs:
        log, frame = read_log(path), frame_of(path)
        begin, end = longest_run(log)
        rows = end - begin
        if rows < SHORTEST:
            expected = f"expected {SHORTEST} or more"
            raise ValueError(f"{path}: the motors are driven for {rows} rows, {expected}")
        run = log.part(begin, end)
        interval = period(run)
        name = path.stem
        write_recording(arguments.out / f"{name}.csv", run, interval)
        (arguments.out / f"{name}.toml").write_text(model(*frame), encoding="utf-8")
        print(f"{name}: rows {begin} to {end} of the log, {1e3 * interval:.2f} ms apart")


if __name__ == "__main__":
    try:
        main()
    except (OSError, ValueError) as error:
        sys.exit(f"cable_robot.py: {error}")
