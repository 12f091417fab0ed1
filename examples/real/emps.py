"""Run as: python examples/real/emps.py nlid_emps_sim_data_training.mat --out emps

Turns the recording of a positioning drive (EMPS) into a recording and a model for `cdpr`.

The drive is a motor with a ball screw that moves a carriage of some 95 kg by 0.25 m. The file has
its position `qm` (m) and the motor's voltage `vir` (V) every millisecond; `gtau` is the force of a
volt (N/V). `cdpr` knows robots on cables, so the carriage becomes a point that one cable pulls
along the rail and two cables, far back and with a constant force, pull the other way. The motor
works on the first cable:

    winch_force[1] = PULL + gtau · vir

which leaves the motor's force on the carriage, whatever PULL is. The guide lets the carriage do
nothing else: y and phi are zero.
"""

import argparse
import sys
from pathlib import Path

import numpy as np
from scipy.io import loadmat

INTERVAL = 9.999839611217580e-04  # s, as the authors give it
EVERY = 20  # rows of the file to a row of the recording: 50 Hz
PULL = 400.0  # N; the motor's force stays within 160 N
MIDDLE = 0.12  # m, of the carriage's way
FAR, SIDE = 10.0, 0.5  # m, of the anchors, which the model wants around the carriage
MASS = 100.0  # kg, a guess


def recording(position, force, every):
    """Rows of time, three winch forces and the pose; forces are means up to the next row."""
    rows = len(position) // every
    time = INTERVAL * every * np.arange(rows)
    motor = force[: rows * every].reshape(rows, every).mean(axis=1)
    back = np.full(rows, 0.5 * PULL * np.hypot(FAR, SIDE) / FAR)
    nothing = np.zeros(rows)
    x = position[: rows * every : every] - MIDDLE
    return np.column_stack([time, PULL + motor, back, back, x, nothing, nothing])


def model():
    """The carriage on its three cables."""
    anchors = [(FAR, 0.0), (-FAR, SIDE), (-FAR, -SIDE)]
    head = [
        "# A positioning drive: a point that moves along x; the motor is the winch of cable 1.",
        'cable_model = "rigid"',
        'cable_inertia = "none"',
        f"platform_mass = {MASS}",
        "platform_inertia = 1.0  # no cable turns a point",
    ]
    cables = [f"\n[[cable]]\nanchor = [{x}, {y}]\nattachment = [0.0, 0.0]" for x, y in anchors]
    return "\n".join([*head, *cables]) + "\n"


def main():
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[2])
    parser.add_argument("file", type=Path, metavar="FILE.mat")
    parser.add_argument("--out", type=Path, required=True, metavar="DIR")
    parser.add_argument("--every", type=int, default=EVERY, help=f"rows to a row, {EVERY}")
    arguments = parser.parse_args()
    data = loadmat(arguments.file)
    missing = [name for name in ("qm", "vir", "gtau") if name not in data]
    if missing:
        raise ValueError(f"{arguments.file}: no variable {', '.join(missing)}")
    position, voltage = data["qm"].ravel(), data["vir"].ravel()
    force = float(data["gtau"].ravel()[0]) * voltage
    table = recording(position, force, arguments.every)
    arguments.out.mkdir(parents=True, exist_ok=True)
    names = ["time", *(f"winch_force[{i}]" for i in (1, 2, 3)), "x", "y", "phi"]
    path = arguments.out / "emps.csv"
    np.savetxt(path, table, delimiter=",", header=",".join(names), comments="", fmt="%.9g")
    (arguments.out / "emps.toml").write_text(model(), encoding="utf-8")
    print(f"emps: {len(table)} rows, {1e3 * INTERVAL * arguments.every:.2f} ms apart")


if __name__ == "__main__":
    try:
        main()
    except (OSError, ValueError) as error:
        sys.exit(f"emps.py: {error}")
