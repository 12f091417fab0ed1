"""Run as: python examples/lqr_from_fmu/lqr.py CablePlatform.fmu lqr.png

A, B, C, D read off the FMU by directional derivatives, a linear-quadratic regulator by
python-control, and the closed loop on the nonlinear FMU. Units: m, rad, s, N.
"""

import sys

import control
import matplotlib as mpl
import numpy as np
from fmpy import extract, read_model_description
from fmpy.fmi2 import FMU2Slave

mpl.use("Agg")
from matplotlib import pyplot as plt

STEP, DURATION = 0.01, 20.0
PULL = 20e3  # N, every winch; at rest in the middle
OFFSET = [10.0, -5.0, 0.1]  # where the closed loop begins
POSE, TWIST = ["x", "y", "phi"], ["vx", "vy", "omega"]
INPUTS = [f"winch_force[{i}]" for i in range(1, 5)]
OUTPUTS = [*POSE, *TWIST, *(f"tension[{i}]" for i in range(1, 5))]
# Deviations that weigh as much as each other: 0.5 m, 0.02 rad, ... against 300 N of winch force.
OUTPUT_SIZES = np.array([0.5, 0.5, 0.02, 0.5, 0.5, 0.02, 1e3, 1e3, 1e3, 1e3])
INPUT_SIZE = 300.0


class Plant:
    """The FMU, addressed by names; the platform at rest at `pose`, springs loaded by `PULL`."""

    def __init__(self, path, pose=(0.0, 0.0, 0.0)):
        folder, description = extract(path), read_model_description(path)
        self.refs = {v.name: v.valueReference for v in description.modelVariables}
        self.rates = [u.variable.name for u in description.derivatives]
        self.states = [u.variable.derivative.name for u in description.derivatives]
        self.fmu = FMU2Slave(
            guid=description.guid,
            unzipDirectory=folder,
            modelIdentifier=description.coSimulation.modelIdentifier,
            instanceName="plant",
        )
        self.fmu.instantiate()
        self.fmu.setupExperiment(startTime=0.0)
        self.fmu.enterInitializationMode()
        self.set(POSE + INPUTS, [*pose, *[PULL] * 4])
        self.fmu.exitInitializationMode()

    def set(self, names, values):
        self.fmu.setReal([self.refs[name] for name in names], [float(v) for v in values])

    def get(self, names):
        return np.array(self.fmu.getReal([self.refs[name] for name in names]))

    def jacobian(self, unknowns, knowns):
        """Partial derivatives of `unknowns` by `knowns`, a column for each call."""
        rows = [self.refs[name] for name in unknowns]
        columns = [
            self.fmu.getDirectionalDerivative(rows, [self.refs[name]], [1.0]) for name in knowns
        ]
        return np.array(columns).T


def linear_model(plant):
    """The FMU about where it is, as a state space system of python-control."""
    a, b = plant.jacobian(plant.rates, plant.states), plant.jacobian(plant.rates, INPUTS)
    c, d = plant.jacobian(OUTPUTS, plant.states), plant.jacobian(OUTPUTS, INPUTS)
    return control.ss(a, b, c, d, states=plant.states, inputs=INPUTS, outputs=OUTPUTS)


def regulator(model):
    """Gain of the sampled regulator, and the sampled model (forces held over a step)."""
    sampled = control.sample_system(model, STEP)
    scaled = sampled.C / OUTPUT_SIZES[:, None]
    gain, _, _ = control.dlqr(sampled, scaled.T @ scaled, np.eye(4) / INPUT_SIZE**2)
    return gain, sampled


def simulate(path, rest, gain):
    """Times, states, winch forces and outputs of the closed loop on the FMU."""
    plant = Plant(path, OFFSET)
    rows = []
    for k in range(round(DURATION / STEP)):
        state = plant.get(plant.states)
        forces = PULL - gain @ (state - rest)
        rows.append([k * STEP, *state, *forces, *plant.get(OUTPUTS)])
        plant.set(INPUTS, forces)
        plant.fmu.doStep(k * STEP, STEP)
    plant.fmu.terminate()
    plant.fmu.freeInstance()
    return np.split(np.array(rows), [1, 1 + len(rest), 5 + len(rest)], axis=1)


def main(path, picture):
    plant = Plant(path)
    model, rest, shown = linear_model(plant), plant.get(plant.states), plant.get(OUTPUTS)
    print(f"fastest growth, forces held: {model.poles().real.max():.4f} 1/s")
    gain, sampled = regulator(model)
    closed = control.ss(sampled.A - sampled.B @ gain, np.zeros((14, 1)), sampled.C, 0, STEP)
    print(f"slowest decay, regulated: {-np.log(abs(closed.poles()).max()) / STEP:.4f} 1/s")

    time, states, forces, outputs = simulate(path, rest, gain)
    linear = control.initial_response(closed, time[:, 0], states[0] - rest).outputs.T + shown
    far = 1e3 * np.hypot(*outputs[:, :2].T)
    print(f"distance from rest {far[0]:.0f} mm at first, {far[-1]:.3f} mm after {DURATION:.0f} s")
    print(f"the linear model is off by up to {1e3 * abs(linear - outputs)[:, :2].max():.1f} mm")
    print(f"winch forces {forces.min():.0f} to {forces.max():.0f} N")
    figure, axes = plt.subplots(3, 1, sharex=True, figsize=(9, 6), layout="constrained")
    for axis, columns, scale, unit in [
        (axes[0], slice(0, 2), 1.0, "x, y (m)"),
        (axes[1], slice(2, 3), 1.0, "φ (rad)"),
        (axes[2], slice(6, 10), 1e-3, "tension (kN)"),
    ]:
        axis.plot(time, scale * outputs[:, columns], label=OUTPUTS[columns])
        axis.set_prop_cycle(None)
        axis.plot(time, scale * linear[:, columns], "k--", lw=0.8)
        axis.set(ylabel=unit, xlim=(0, DURATION))
        axis.legend(ncols=2)
    axes[0].set(title="Closed loop on the FMU, and what the linear model says (dashed)")
    axes[2].set(xlabel="time (s)")
    figure.savefig(picture, dpi=100)


if __name__ == "__main__":
    main(*sys.argv[1:])
