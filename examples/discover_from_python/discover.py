"""Record a robot through FMI, hide an effect in it, find it, and plot how the gap shrinks.

See README.md for how it is run. Units: m, rad, s, N.
"""

import csv
import json
import os
import subprocess
import sys
from itertools import pairwise
from pathlib import Path

import matplotlib as mpl
import numpy as np
from fmpy import extract, read_model_description
from fmpy.fmi2 import FMU2Slave

mpl.use("Agg")
from matplotlib import pyplot as plt

ROOT = Path(__file__).resolve().parents[2]
CDPR = os.environ.get("CDPR_BIN", ROOT / "target" / "release" / "cdpr")
STEP = 0.04
LEAD_IN = 10.0  # under way this long before the recording begins
FORCES = [f"winch_force[{i}]" for i in range(1, 5)]
POSE = ["x", "y", "phi"]
LENGTHS = [f"unstretched_length[{i}]" for i in range(1, 5)]
NOISE = np.array([5e-3, 5e-3, 5e-5, 2e-3, 2e-3, 2e-3, 2e-3])
RATES = ["vx", "vy", "omega", *(f"unstretched_length_rate[{i}]" for i in range(1, 5))]

HIDDEN = """
[[effect]]
id = "winch_coulomb_friction"
cable = 2
force = 220.0
transition_speed = 0.02
"""


class Robot:
    """An FMU, driven step by step through FMI."""

    def __init__(self, path, start):
        folder = extract(path)
        description = read_model_description(folder)
        self.reference = {v.name: v.valueReference for v in description.modelVariables}
        self.fmu = FMU2Slave(
            guid=description.guid,
            unzipDirectory=folder,
            modelIdentifier=description.coSimulation.modelIdentifier,
            instanceName="robot",
        )
        self.time = 0.0
        self.fmu.instantiate()
        self.fmu.setupExperiment()
        self.set(start)
        if set(start) & set(LENGTHS):  # every state is given
            self.fmu.setInteger([self.reference["initialization"]], [2])  # from_states
        self.fmu.enterInitializationMode()
        self.fmu.exitInitializationMode()

    def set(self, values):
        self.fmu.setReal(
            [self.reference[name] for name in values], [float(v) for v in values.values()]
        )

    def get(self, names):
        return np.array(self.fmu.getReal([self.reference[name] for name in names]))

    def step(self, forces):
        """Pull with these forces for one step; what the sensors show after it."""
        self.set(dict(zip(FORCES, forces, strict=True)))
        self.fmu.doStep(self.time, STEP)
        self.time += STEP
        return self.get(POSE + LENGTHS)


def structure(pose):
    """The wrench of a unit of tension in each cable, 3 by 4 (anchors and platform of the model)."""
    x, y, phi = pose
    anchor = 900.0 * np.exp(1j * np.radians([-135.0, -45.0, 45.0, 135.0]))
    arm = 10.0 * np.exp(1j * (np.radians([-45.0, -135.0, 135.0, 45.0]) + phi))
    pull = anchor - (x + 1j * y + arm)
    pull /= abs(pull)
    return np.array([pull.real, pull.imag, (arm.conj() * pull).imag])


def record(path, fmu, duration, seed):
    """A recording under control: an observer, a spring and a damper towards a path."""
    random = np.random.default_rng(seed)
    waves = [(1.8, 29.0), (1.0, 17.0), (0.5, 9.0)]
    phases = random.uniform(0.0, 2.0 * np.pi, (len(waves), 3))
    size = np.array([1.0, 0.9, 0.012])

    def path_at(t):
        fade = np.sin(0.5 * np.pi * min(t / 8.0, 1.0)) ** 2
        pairs = zip(waves, phases, strict=True)
        turn = [a * np.sin(2.0 * np.pi * t / p + f) for (a, p), f in pairs]
        return fade * size * np.sum(turn, axis=0)

    robot = Robot(fmu, dict.fromkeys(FORCES, 2e4))
    seen, speed, acceleration = np.zeros(3), np.zeros(3), np.zeros(3)
    mass = np.array([2800.0, 2800.0, 3.6e5])
    rows, shown = [], robot.get(POSE + LENGTHS)
    for k in range(round((LEAD_IN + duration) / STEP)):
        measured = shown + NOISE * random.standard_normal(7)
        surprise = measured[:3] - (seen + STEP * speed)
        seen = seen + STEP * speed + 2.8 * STEP * surprise
        speed = speed + STEP * (acceleration + 4.0 * surprise)
        wanted, later = path_at(k * STEP), path_at((k + 1) * STEP)
        acceleration = 0.25 * (wanted - seen) + 0.8 * ((later - wanted) / STEP - speed)
        a = structure(seen)
        forces = 2e4 + np.linalg.pinv(a) @ (mass * acceleration - a @ np.full(4, 2e4))
        if k * STEP >= LEAD_IN:
            rows.append([k * STEP - LEAD_IN, *forces, *measured])
        shown = robot.step(forces)
    header = ",".join(["time", *FORCES, *POSE, *LENGTHS])
    np.savetxt(path, rows, "%.9g", ",", header=header, comments="")


def read(path):
    """A table's columns as arrays; an empty cell is nan."""
    with open(path, newline="", encoding="utf-8") as file:
        rows = list(csv.DictReader(file))
    return {name: np.array([float(row[name] or "nan") for row in rows]) for name in rows[0]}


def prediction(fmu, recording, states, restarts):
    """What the FMU predicts, running free from each restart to the next."""
    predicted = np.full((len(recording["time"]), 7), np.nan)
    for begin, end in pairwise([*restarts, len(predicted)]):
        if end - begin < 4:
            continue
        value = states[begin : begin + 4]
        rate = (-11.0 * value[0] + 18.0 * value[1] - 9.0 * value[2] + 2.0 * value[3]) / (6.0 * STEP)
        start = dict(zip(POSE + LENGTHS + RATES, [*value[0], *rate], strict=True))
        forces = np.column_stack([recording[name] for name in FORCES])[begin:end]
        robot = Robot(fmu, start | dict(zip(FORCES, forces[0], strict=True)))
        predicted[begin + 1 : end] = [robot.step(row) for row in forces[:-1]]
        robot.fmu.freeInstance()
    return predicted


def main():
    out = Path(sys.argv[1] if len(sys.argv) > 1 else "discovered")
    out.mkdir(parents=True, exist_ok=True)
    (out / "robot.toml").write_text(HIDDEN)
    hidden = ["--model", out / "robot.toml", "-o", out / "robot.fmu"]
    subprocess.run([CDPR, "fmu", *hidden], check=True)
    subprocess.run([CDPR, "fmu", "-o", out / "model.fmu"], check=True)
    record(out / "run.csv", out / "robot.fmu", 60.0, seed=1)
    record(out / "check.csv", out / "robot.fmu", 40.0, seed=2)

    recordings = ["--data", out / "run.csv", "--holdout", out / "check.csv"]
    subprocess.run([CDPR, "discover", *recordings, "--out", out / "found"], check=True)
    result = json.loads((out / "found" / "discovery.json").read_text(encoding="utf-8"))
    noise = np.array([result["channels"][name]["noise"] for name in POSE + LENGTHS])

    # gap.csv has the states from which the search's own simulations start, every 5 s.
    recording = read(out / "check.csv")
    measured = np.column_stack([recording[name] for name in POSE + LENGTHS])
    with open(out / "found" / "gap.csv", newline="", encoding="utf-8") as file:
        rows = [row for row in csv.DictReader(file) if row["trial"] == str(out / "check.csv")]
    of = {name: [row for row in rows if row["channel"] == name] for name in POSE + LENGTHS}
    restarts = [k for k, row in enumerate(of["x"]) if row["restart"] == "1"]
    figure, (above, below) = plt.subplots(2, 1, sharex=True, figsize=(9, 6), layout="constrained")
    above.plot(recording["time"], 1e3 * recording["phi"], "0.6", lw=4, label="measured")
    for side, fmu, colour in [
        ("before", out / "model.fmu", "tab:orange"),
        ("after", out / "found" / "CablePlatform.fmu", "tab:blue"),
    ]:
        states = np.array([[float(row[side] or "nan") for row in of[name]] for name in of]).T
        predicted = prediction(fmu, recording, states, restarts)
        error = (predicted - measured) / noise
        gap = np.sqrt(np.nanmean(error**2))
        print(f"{fmu} is off by {gap:.3g} times the noise ({side})")
        label = f"FMU {side}: {gap:.3g} times the noise"
        above.plot(recording["time"], 1e3 * predicted[:, 2], colour, label=label)
        below.plot(recording["time"], error[:, 2], colour)
    above.set(ylabel="rotation φ (mrad)", title="Held-out recording, predicted 5 s ahead")
    below.set(ylabel="error / noise", xlabel="time (s)", yscale="symlog")
    above.legend()
    figure.savefig(out / "gap.png", dpi=120)
    print(f"plotted in {out / 'gap.png'}")


if __name__ == "__main__":
    main()
