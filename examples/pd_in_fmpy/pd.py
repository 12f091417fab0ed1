"""Run as: python examples/pd_in_fmpy/pd.py CablePlatform.fmu pd.png

A PD controller with tension distribution around the FMU, in a plain FMPy loop: one circle of 5 m
radius in 60 s, from rest to rest. Units: m, rad, s, N.
"""

import sys

import matplotlib as mpl
import numpy as np
from fmpy import extract, read_model_description
from fmpy.fmi2 import FMU2Slave

mpl.use("Agg")
from matplotlib import pyplot as plt

STEP, TURN, RADIUS = 0.01, 60.0, 5.0
PRETENSION = 20e3  # of every cable, before the controller asks for a wrench
BANDWIDTH, DAMPING = 0.4, 0.8  # of the loop: rad/s, and a damping ratio
LOW_PASS = 0.3  # time constant: feedback stays clear of the winch masses, which swing at 13 rad/s
FORCES = [f"winch_force[{i}]" for i in range(1, 5)]
TENSIONS = [f"tension[{i}]" for i in range(1, 5)]
POSE, TWIST = ["x", "y", "phi"], ["vx", "vy", "omega"]


class Plant:
    """The FMU in Initialization Mode, its variables by their names."""

    def __init__(self, path):
        description = read_model_description(path)
        self.refs = {v.name: v.valueReference for v in description.modelVariables}
        self.fmu = FMU2Slave(
            guid=description.guid,
            unzipDirectory=extract(path),
            modelIdentifier=description.coSimulation.modelIdentifier,
            instanceName="plant",
        )
        self.fmu.instantiate()
        self.fmu.setupExperiment(startTime=0.0)
        self.fmu.enterInitializationMode()

    def set(self, names, values):
        self.fmu.setReal([self.refs[name] for name in names], [float(v) for v in values])

    def get(self, names):
        return np.array(self.fmu.getReal([self.refs[name] for name in names]))


class Robot:
    """What the controller knows of the robot: the FMU's parameters."""

    def __init__(self, plant):
        for kind in ("anchor", "attachment"):  # points of the plane as complex numbers
            angles = plant.get([f"{kind}_angle[{i}]" for i in range(1, 5)])
            setattr(self, kind, plant.get([f"{kind}_radius"]) * np.exp(1j * angles))
        mass, inertia = plant.get(["platform_mass", "platform_inertia"])
        self.inertia, self.density = np.diag([mass, mass, inertia]), plant.get(["cable_density"])

    def forces(self, pose, acceleration):
        """The winch forces nearest to the pretension that give this acceleration."""
        arm = self.attachment * np.exp(1j * pose[2])
        cable = self.anchor - (pose[0] + 1j * pose[1] + arm)
        along, across, mass = cable / abs(cable), 1j * cable / abs(cable), self.density * abs(cable)
        # Structure matrix: the wrench of a unit of force along each cable; and the same across it.
        a, b = (np.array([u.real, u.imag, (arm.conj() * u).imag]) for u in (along, across))
        # Half of a cable's mass follows the platform along it, a third across it.
        wrench = (self.inertia + a * (mass / 2) @ a.T + b * (mass / 3) @ b.T) @ acceleration
        inverse = np.linalg.pinv(a)
        null_space = np.eye(4) - inverse @ a  # forces that cancel each other
        return inverse @ wrench + null_space @ np.full(4, PRETENSION)


def reference(t):
    """Pose, twist and acceleration on the circle, at rest at both ends."""
    w = 2 * np.pi / TURN
    angle, rate, bend = w * t - np.sin(w * t), w * (1 - np.cos(w * t)), w * w * np.sin(w * t)
    out = RADIUS * np.array([np.cos(angle), np.sin(angle), 0.0])
    on = RADIUS * np.array([-np.sin(angle), np.cos(angle), 0.0])
    return out, rate * on, bend * on - rate**2 * out


def simulate(path):
    """Rows of time, pose, reference, winch forces, tensions."""
    plant = Plant(path)
    robot = Robot(plant)
    pose, _, acceleration = reference(0.0)
    # Forces that cancel each other at this pose, every spring loaded by its force: at rest.
    plant.set(POSE + FORCES, [*pose, *robot.forces(pose, acceleration)])
    plant.fmu.exitInitializationMode()
    rows, feedback = [], np.zeros(3)
    for time in STEP * np.arange(round(TURN / STEP) + 1):
        pose, twist = plant.get(POSE), plant.get(TWIST)
        wanted, speed, acceleration = reference(time)
        pd = BANDWIDTH**2 * (wanted - pose) + 2 * DAMPING * BANDWIDTH * (speed - twist)
        feedback += (1 - np.exp(-STEP / LOW_PASS)) * (pd - feedback)
        forces = robot.forces(pose, acceleration + feedback)
        rows.append([time, *pose, *wanted, *forces, *plant.get(TENSIONS)])
        plant.set(FORCES, forces)
        plant.fmu.doStep(time, STEP)
    plant.fmu.terminate()
    plant.fmu.freeInstance()
    return np.array(rows)


def main(path, picture):
    time, pose, wanted, forces, tensions = np.split(simulate(path), [1, 4, 7, 11], axis=1)
    error = 1e3 * np.hypot(*(pose - wanted)[:, :2].T)
    print(f"largest tracking error {error.max():.3f} mm, {1e3 * abs(pose[:, 2]).max():.4f} mrad")
    print(f"winch forces {forces.min():.0f} to {forces.max():.0f} N")
    print(f"tensions {tensions.min():.0f} to {tensions.max():.0f} N")
    figure, axes = plt.subplot_mosaic("ab;ac", figsize=(10, 4.5), layout="constrained")
    axes["a"].plot(*wanted[:, :2].T, "0.7", lw=5, label="wanted")
    axes["a"].plot(*pose[:, :2].T, "tab:blue", label="FMU")
    axes["a"].set(xlabel="x (m)", ylabel="y (m)", aspect="equal", title="One turn in 60 s")
    axes["a"].legend(loc="center")
    axes["b"].plot(time, error, "tab:red")
    axes["b"].set(ylabel="distance from\nreference (mm)", xlim=(0, TURN), ylim=(0, None))
    axes["c"].plot(time, 1e-3 * forces, label=["winch 1", "winch 2", "winch 3", "winch 4"])
    axes["c"].set(xlabel="time (s)", ylabel="winch force (kN)", xlim=(0, TURN))
    axes["c"].margins(y=0.25)
    axes["c"].legend(ncols=4, loc="lower center", fontsize="small")
    figure.savefig(picture, dpi=100)


if __name__ == "__main__":
    main(*sys.argv[1:])
