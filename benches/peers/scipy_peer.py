"""The first steps of a closed loop by scipy, on the plant that the tests have in Python.

Standard input: the start pose, then one line of winch forces for each step of 10 ms. Standard
output: a line for each method and round: name, tolerance, processor time of a step (s), end pose.
The equations are evaluated in Python here, which is most of what is measured.
"""

import sys
import time

import numpy as np
from scipy.integrate import solve_ivp

from reference.parameters import Parameters
from reference.plant import Plant

STEP = 0.01
ROUNDS = 3
METHODS = [("RK45", 1e-8), ("DOP853", 1e-8), ("Radau", 1e-8), ("BDF", 1e-8)]


def run(plant, start, forces, method, tolerance):
    """The end states and the time of a step (s)."""
    y, none = start.copy(), np.zeros(3)
    begun = time.thread_time()
    for k, force in enumerate(forces):
        span = (k * STEP, (k + 1) * STEP)
        # As the change since the step's start, so that the tolerance is in metres.
        result = solve_ivp(
            lambda t, change, base=y, force=force: plant.evaluate(t, base + change, force, none)[0],
            span,
            np.zeros_like(y),
            method=method,
            rtol=1e-12,
            atol=tolerance,
            first_step=span[1] - span[0] if method in ("RK45", "DOP853") else None,
        )
        if not result.success:
            raise RuntimeError(f"{method}: {result.message}")
        y = y + result.y[:, -1]
    return y, (time.thread_time() - begun) / len(forces)


def main():
    pose, *forces = [np.array(line.split(), dtype=float) for line in sys.stdin]
    plant = Plant(Parameters())
    start = plant.initial_state(pose, np.zeros(3), forces[0])
    for _ in range(ROUNDS):
        for method, tolerance in METHODS:
            y, took = run(plant, start, forces, method, tolerance)
            print(method, tolerance, took, *y[:3])


if __name__ == "__main__":
    main()
