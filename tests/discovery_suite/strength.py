"""How strongly the hidden effect shows: the numbers that decide whether a case is fair.

`strength` replays the plant without the effect under the recorded inputs, restarted every few
seconds from the true state: the root mean square of its distance from the readings, in standard
deviations of the sensor noise. A model without the effect shows a gap of about
`sqrt(1 + strength^2)`.

`evidence` lets the state at each start be fitted, as a workflow has to, and the parameters of a
rival effect too. What is left is a chi-square: about twice the log likelihood ratio by which the
data prefer the truth to the rival (or to no effect). Near ten and below nothing can be told.
"""

import copy

import numpy as np
from numba import njit

from . import parameters
from .plant import derivative, layout, lengths, replay

# Steps for sensitivities to the state entries that a workflow estimates (m, rad, s): the
# platform's, and of each cable.
STEPS, OF_CABLE = [1e-3, 1e-3, 1e-5, 1e-4, 1e-4, 1e-6], [1e-3, 1e-3]


def columns(cables):
    """All sensors of a robot with so many cables."""
    kinds = ("cable_length", "unstretched_length", "tension")
    return ["x", "y", "phi"] + [f"{kind}[{i}]" for kind in kinds for i in range(1, cables + 1)]


def steps(record):
    """Steps of all entries of the state that a workflow estimates."""
    return np.array(STEPS + OF_CABLE * record.settings.robot.cables)


@njit(cache=True, error_model="numpy")
def observe(p, states, forces, wrench):
    """Noise-free readings of all sensors, a row a sample in the order of `columns`."""
    n = len(states)
    cables, own, payouts, _, _, _, _ = layout(p)
    chords, paid_out = 3 + cables, 3 + 2 * cables
    out = np.empty((n, 3 + 3 * cables))
    rate = np.zeros(states.shape[1])
    for k in range(n):
        out[k, :3] = states[k, :3]
        lengths(p, states[k], out[k, 3:chords])
        shown = out[k, 3:chords] if p.rigid else states[k, own:payouts]
        out[k, chords:paid_out] = shown
        derivative(p, 0.0, states[k], forces[k], wrench[k], rate, out[k, paid_out:])
    return out


def _windows(record, span):
    """First and last sample of each window of `span` seconds."""
    size = max(round(span / record.dt), 1)
    n = len(record.states)
    return [(first, min(first + size, n - 1)) for first in range(0, n - 1, size)]


def _start(record, candidate, first):
    """True state at a sample, without memory that the candidate does not have."""
    state = record.states[first].copy()
    cables, _, _, lagged, creep, *_ = layout(record.params)
    if not candidate.creep_ea.any():
        state[creep : creep + cables] = 0.0
    if not record.params.lag.any():
        state[lagged : lagged + cables] = record.forces[first]
    return state


def _residual(record, candidate, sensor_error, start, first, last):
    """(candidate - readings without noise) / noise, (samples, channels), over one window."""
    h = min(parameters.step_size(candidate), 1e-3)
    inputs = record.forces, record.recorded, record.hidden
    states = replay(candidate, 0.0, record.dt, h, start, first, last, *inputs)
    window = slice(first, last + 1)
    wrench = record.recorded[window] + record.hidden[window]
    found = observe(candidate, states, record.forces[window], wrench)
    order = columns(record.settings.robot.cables)
    gaps = []
    for name in record.columns:
        scale, bias = sensor_error.get(name, (0.0, 0.0))
        reading = found[:, order.index(name)] * (1.0 + scale) + bias
        gaps.append((reading - record.clean[name][window]) / record.noise[name])
    return np.column_stack(gaps)


def strength(record, cable_model="lumped_mass", horizon=5.0):
    """Root mean square distance of the plant without effects, in noise units (see above)."""
    nominal = parameters.build((), cable_model, record.settings.robot)
    pieces = [
        _residual(record, nominal, {}, _start(record, nominal, first), first, last)
        for first, last in _windows(record, horizon)
    ]
    return float(np.sqrt(np.mean(np.concatenate(pieces) ** 2)))


def _candidate(rival, free, values, cable_model, robot):
    """Plant and sensor errors of the rival with these values of its free parameters."""
    if rival is None:
        return parameters.build((), cable_model, robot), {}
    made = copy.deepcopy(rival)
    made["parameters"].update(zip(free, map(float, values), strict=True))
    errors = {}
    if made["id"].startswith("length_sensor"):
        p = made["parameters"]
        name = f"{made.get('channel', 'unstretched_length')}[{made['cable']}]"
        errors[name] = (p.get("factor", 0.0), p.get("bias", 0.0))
    return parameters.build([made], cable_model, robot), errors


def evidence(record, rival=None, free=(), cable_model="lumped_mass", window=20.0, rounds=3):
    """Chi-square by which the truth beats the best fit of `rival` (none: of no effect).

    Gauss-Newton on the rival's `free` parameters and on the state at the start of each window; the
    states are projected out window by window.
    """
    values = np.array([rival["parameters"][name] for name in free]) if rival else np.empty(0)
    scale, robot, sizes = np.abs(values), record.settings.robot, steps(record)
    windows = _windows(record, window)
    base, _ = _candidate(rival, free, values, cable_model, robot)
    starts = [_start(record, base, first) for first, _ in windows]
    best = np.inf
    for _ in range(rounds):
        plant, errors = _candidate(rival, free, values, cable_model, robot)
        count = len(values)
        normal, right, total, parts = np.zeros((count, count)), np.zeros(count), 0.0, []
        for (first, last), start in zip(windows, starts, strict=True):
            r = _residual(record, plant, errors, start, first, last).ravel()
            by_state = np.empty((r.size, sizes.size))
            for j, step in enumerate(sizes):
                moved = start.copy()
                moved[j] += step
                shifted = _residual(record, plant, errors, moved, first, last).ravel()
                by_state[:, j] = shifted - r
            by_value = np.empty((r.size, count))
            for j in range(count):
                nudged = values.copy()
                nudged[j] += 1e-3 * scale[j]
                other = _candidate(rival, free, nudged, cable_model, robot)
                shifted = _residual(record, *other, start, first, last).ravel()
                by_value[:, j] = (shifted - r) / 1e-3
            q, upper = np.linalg.qr(by_state)
            r_free = r - q @ (q.T @ r)
            v_free = by_value - q @ (q.T @ by_value)
            normal += v_free.T @ v_free
            right -= v_free.T @ r_free
            total += r_free @ r_free
            parts.append((q, upper, r, by_value))
        step = np.linalg.lstsq(normal, right, rcond=None)[0] if count else np.empty(0)
        best = min(best, total - right @ step)
        values = values + step * scale
        starts = [
            _moved(start, sizes * np.linalg.solve(upper, -q.T @ (r + by_value @ step)))
            for start, (q, upper, r, by_value) in zip(starts, parts, strict=True)
        ]
    return float(best)


def _moved(start, by):
    """A start state with its first entries moved by so much."""
    state = start.copy()
    state[: by.size] += by
    return state
