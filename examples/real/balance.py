"""Run as: python examples/real/balance.py LOG CALIBRATED.toml

The balance of forces on the four-cable robot by plain least squares, without `cdpr`: what of the
winches' pull is no acceleration of the platform, and what of that goes with the sign of each
cable's speed, or with the platform's speed. It uses the drums' speeds, which the recordings for
`cdpr` do not have.
"""

import sys
import tomllib
from pathlib import Path

import numpy as np
from cable_robot import forces, longest_run, period, read_log
from scipy.signal import savgol_filter

WINDOW = 15  # rows, of the straight lines and parabolas that smooth
SIGN = 0.01  # m/s, in which friction turns


def geometry(path):
    """Anchors and offsets of the lengths (m) in a model's file."""
    model = tomllib.loads(path.read_text(encoding="utf-8"))
    anchors = np.array([cable["anchor"] for cable in model["cable"]])
    offsets = np.zeros(len(anchors))
    for effect in model.get("effect", []):
        if effect["id"] == "length_sensor_bias":
            offsets[effect["cable"] - 1] = effect["bias"]
    return anchors, offsets


def directions(anchors, lengths):
    """Unit vectors along the cables, away from the anchors, at the points that the lengths tell."""
    points = np.zeros((len(lengths), 2))
    for _ in range(30):
        apart = points[:, None] - anchors
        distance = np.linalg.norm(apart, axis=2)
        along = apart / distance[..., None]
        normal = np.einsum("tij,tik->tjk", along, along)
        right = np.einsum("tij,ti->tj", along, lengths - distance)
        points += np.linalg.solve(normal, right[..., None])[..., 0]
    return along


def fit(columns, force):
    """Least squares with the share of the force's variance that is explained."""
    table = np.column_stack([column.ravel() for column in columns])
    values, *_ = np.linalg.lstsq(table, force.ravel(), rcond=None)
    left = force.ravel() - table @ values
    return values, 1.0 - left.var() / force.var()


def main():
    log = read_log(Path(sys.argv[1]))
    log = log.part(*longest_run(log))
    interval = period(log)
    anchors, offsets = geometry(Path(sys.argv[2]))
    along = directions(anchors, log.length - offsets)
    normal = np.einsum("tij,tik->tjk", along, along)
    speed = np.linalg.solve(normal, np.einsum("tij,ti->tj", along, log.speed)[..., None])[..., 0]

    def smooth(values, derivative=0):
        return savgol_filter(values, WINDOW, 2, deriv=derivative, delta=interval, axis=0)

    def on_platform(pulls):
        return smooth(-np.einsum("tij,ti->tj", along, pulls))

    acceleration, pull = smooth(speed, 1), forces(log)
    force = on_platform(pull)
    moving = np.tanh(log.speed / SIGN)
    each = np.eye(4)
    base = [acceleration, np.tile([1.0, 0.0], (len(pull), 1)), np.tile([0.0, 1.0], (len(pull), 1))]
    # Friction adds to the pull of a cable that is paid out, so it is taken from the force.
    dry = [-on_platform(moving * each[i]) for i in range(4)]
    share = [-on_platform(pull * moving)]
    for words, more in [
        ("mass and a constant force", []),
        ("and dry friction, N, cables 1 to 4", dry),
        ("and friction as a share of the pull", share),
        ("and linear drag of the platform, N s/m", [smooth(speed)]),
    ]:
        values, explained = fit([*base, *more], force)
        shown = " ".join(f"{v:.2f}" for v in values[len(base) :])
        print(f"R² {explained:.2f}  mass {values[0]:.1f} kg  {words} {shown}".rstrip())


if __name__ == "__main__":
    main()
