"""Integration of the reference plant over inputs that jump."""

from __future__ import annotations

import itertools
from dataclasses import dataclass

import numpy as np
from scipy.integrate import solve_ivp

from .parameters import Inputs
from .plant import Plant


@dataclass
class Trajectory:
    """Samples of a run; `outputs[name]` are arrays over `t`, inputs taken as left limits."""

    t: np.ndarray
    y: np.ndarray
    outputs: dict[str, np.ndarray]


def simulate(plant: Plant, y0, inputs: Inputs, t_out, rtol=1e-12, atol=1e-12) -> Trajectory:
    """Integrate from `t_out[0]`, restarting wherever an input (delayed or not) has a knot."""
    t_out = np.asarray(t_out, dtype=float)
    start, end = t_out[0], t_out[-1]
    delays = plant.winches.delays
    knots = {start, end}
    switches = [t for effect in plant.parameters.effects for t in effect.switches]
    knots.update(t for t in switches if start < t < end)
    for knot in inputs.times:
        knots.update(t for t in (knot, *(knot + delays)) if start < t < end)
    knots = sorted(knots)

    states = [np.asarray(y0, dtype=float)]
    rows = [_outputs_at(plant.at(start), inputs, delays, start, start, states[0])]
    y = states[0]
    for begin, stop in itertools.pairwise(knots):
        middle = 0.5 * (begin + stop)
        now = plant.at(middle)
        wanted = t_out[(t_out > begin) & (t_out <= stop)]

        # Integrated as the change since the segment's start: a cable of 900 m would otherwise have
        # 1e-9 m of error by its relative tolerance, which the stiff springs turn into force.
        def rate(t, change, now=now, middle=middle, base=y):
            command, wrench = _inputs_at(inputs, delays, middle, t)
            return now.evaluate(t, base + change, command, wrench)[0]

        grid = wanted if wanted.size and wanted[-1] == stop else np.append(wanted, stop)
        run = solve_ivp(
            rate,
            (begin, stop),
            np.zeros_like(y),
            method="DOP853",
            rtol=rtol,
            atol=atol,
            t_eval=grid,
        )
        if not run.success:
            raise RuntimeError(f"reference integration stopped at {run.t[-1]} s: {run.message}")
        for k, t in enumerate(wanted):
            states.append(y + run.y[:, k])
            rows.append(_outputs_at(now, inputs, delays, middle, t, states[-1]))
        y = y + run.y[:, -1]

    outputs = {name: np.array([row[name] for row in rows]) for name in rows[0]}
    _delay_pose(plant, states, outputs, t_out)
    return Trajectory(t_out, np.array(states), outputs)


def _inputs_at(inputs: Inputs, delays, side: float, t: float):
    """Delayed winch commands and the wrench at `t`, by the segments that hold at `side`."""
    command = np.array(
        [
            inputs.on_segment(inputs.segment(side - delay), t - delay)[i]
            for i, delay in enumerate(delays)
        ]
    )
    return command, inputs.on_segment(inputs.segment(side), t)[len(delays) :]


def _outputs_at(plant, inputs, delays, side, t, y):
    command, wrench = _inputs_at(inputs, delays, side, t)
    return plant.outputs(t, y, command, wrench)


def _delay_pose(plant, states, outputs, t_out):
    """A late pose sensor: exact where the delay is a whole number of output steps."""
    for effect in plant.parameters.find("pose_sensor_delay"):
        steps = effect.values["delay"] / np.diff(t_out)
        shift = round(float(steps[0]))
        if not np.allclose(steps, shift, atol=1e-6):
            raise ValueError("the pose delay must be a whole number of equal output steps")
        for k, name in enumerate(("x", "y", "phi")):
            pose = np.array([state[k] for state in states])
            outputs[name] += (
                np.concatenate([np.full(shift, pose[0]), pose[: -shift or None]]) - pose
            )
