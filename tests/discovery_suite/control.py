"""A pose controller of the ordinary kind: observer, PD with feed-forward, tension distribution.

It knows the plant's nominal geometry and mass only, and reads the noisy pose sensor at the record
rate. Its forces are held between samples, so the recorded winch forces are what the plant received.
It must hold the rotation: equal tension in crossed cables is unstable there.
"""

import math

import numpy as np
from numba import njit

from .plant import at_rest, derivative, interval, split_delay


@njit(cache=True, error_model="numpy")
def distribute(p, pose, force_x, force_y, torque, mean, out):
    """The tensions (N) nearest to each other, of this mean, that give a wrench at a pose beside
    the weight; rounded to 1 mN as a drive does.

    Three cables have no choice, and then no mean.
    """
    cables = int(p.cables)
    cos, sin = math.cos(pose[2]), math.sin(pose[2])
    rows = 3 if cables == 3 else 4
    a = np.ones((rows, cables))
    for i in range(cables):
        ex = cos * p.body_x[i] - sin * p.body_y[i]
        ey = sin * p.body_x[i] + cos * p.body_y[i]
        dx, dz = pose[0] + ex - p.anchor_x[i], pose[1] + ey - p.anchor_y[i]
        chord = math.sqrt(dx * dx + dz * dz)
        a[0, i], a[1, i] = -dx / chord, -dz / chord
        a[2, i] = (ex * a[1, i] - ey * a[0, i]) / p.lever
    wanted = np.empty(rows)
    wanted[0] = force_x - p.mass * p.gravity_x
    wanted[1] = force_y - p.mass * p.gravity_y
    wanted[2] = torque / p.lever
    if rows > 3:
        wanted[3] = mean * cables
    tensions = a.T @ np.linalg.solve(a @ a.T, wanted)
    for i in range(cables):
        tension = min(max(tensions[i], p.least), p.most)
        out[i] = round(tension * 1000.0) / 1000.0


# What the controller remembers: seen pose, seen rate, wrench it asked for.
MEMORY = 9


@njit(cache=True, error_model="numpy")
def control_step(model, memory, measured, wanted, pretension, dt, gains, out):
    """One sample of the controller: `out` gets the winch forces (N).

    `measured` is the pose read now, `wanted` (3, 3) the reference pose, rate and acceleration,
    `gains` the loop's frequency (rad/s), its damping and the observer's frequency (rad/s).
    `memory` is updated.
    """
    inertia = np.array([model.feed_mass, model.feed_mass, model.feed_inertia])
    omega, zeta, watch = gains[0], gains[1], gains[2]
    seen, speed, wrench = memory[:3], memory[3:6], memory[6:]
    for a in range(3):
        predicted = seen[a] + dt * speed[a]
        innovation = measured[a] - predicted
        seen[a] = predicted + 1.4 * watch * dt * innovation
        speed[a] += dt * (wrench[a] / inertia[a] + watch * watch * innovation)
        accel = wanted[2, a] + omega * omega * (wanted[0, a] - seen[a])
        accel += 2.0 * zeta * omega * (wanted[1, a] - speed[a])
        wrench[a] = accel * inertia[a]
    distribute(model, seen, wrench[0], wrench[1], wrench[2], pretension, out)


@njit(cache=True, error_model="numpy")
def play(p, commanded, before, out):
    """Forces that act (N): where a winch has play, what acted before until it is taken along."""
    c = p.outside_coefficients
    for i in range(len(out)):
        out[i] = commanded[i]
        if p.outside == 10.0 and i == int(c[1]) - 1:
            half = 0.5 * c[0]
            out[i] = min(max(before[i], commanded[i] - half), commanded[i] + half)


@njit(cache=True, error_model="numpy")
def seen(pose, frame):
    """A pose as seen by an instrument.

    Its frame is turned by `frame[0]` (rad), lengths in it are wrong by `frame[3]` (1), and it sees
    the point `frame[1:3]` (m, body frame).
    """
    angle, x, y, factor = frame
    cos, sin = math.cos(pose[2]), math.sin(pose[2])
    mark_x, mark_y = pose[0] + cos * x - sin * y, pose[1] + sin * x + cos * y
    cos, sin = math.cos(angle), math.sin(angle)
    out = np.empty(3)
    out[0] = (1.0 + factor) * (cos * mark_x + sin * mark_y)
    out[1] = (1.0 + factor) * (cos * mark_y - sin * mark_x)
    out[2] = pose[2] - angle
    return out


@njit(cache=True, error_model="numpy")
def closed_loop(
    plants,
    switches,
    model,
    t0,
    dt,
    h,
    reference,
    pretension,
    noise,
    bias,
    frame,
    delay,
    recorded,
    hidden,
    dither,
    gains,
):
    """Run a trial of `n` samples in closed loop from rest at the first reference pose.

    `reference` (n, 3, 3) holds pose, its rate and acceleration; `pretension` (n) the mean tension;
    `noise` (n, 3), `bias` (3), `frame` (of `seen`) and `delay` (s) act on the pose sensor;
    `recorded` (n, 3) and `hidden` (n + 1, 3) are disturbances; `dither` (n, cables) is added to the
    forces. `plants` are the plant up to the first of the `switches` (s, ascending), from there on,
    and so forth; `model` is what the controller believes. Returns states, winch forces, tensions, a
    row a sample, and measured poses (n, 3).
    """
    n, cables = len(reference), int(model.cables)
    forces = np.zeros((n, cables))
    acting = np.zeros((n, cables))
    tensions = np.empty((n, cables))
    measured = np.empty((n, 3))
    taps = np.empty((n, 3))
    memory = np.zeros(MEMORY)
    memory[:3] = reference[0, 0]
    whole, rest = split_delay(delay, dt)
    tap_at = dt - rest if rest > 0.0 else 0.0
    distribute(model, reference[0, 0], 0.0, 0.0, 0.0, pretension[0], forces[0])
    y = at_rest(plants[np.sum(switches <= t0)], t0, reference[0, 0], forces[0])
    states = np.empty((n, len(y)))
    work = np.zeros((7, len(y)))
    rate = np.zeros(len(y))
    for k in range(n):
        # Sensor: the pose now, or the one tapped `delay` ago (the pose at rest before the start).
        pose = y[:3]
        if whole > 0 or rest > 0.0:
            # Interval j was tapped at t_j + dt - rest, or at t_j itself when nothing is left over.
            j = k - whole - (1 if rest > 0.0 else 0)
            pose = taps[j] if j >= 0 else reference[0, 0]
        measured[k] = seen(pose, frame) + bias + noise[k]
        if k > 0:
            control_step(
                model, memory, measured[k], reference[k], pretension[k], dt, gains, forces[k]
            )
            for i in range(cables):
                forces[k, i] = round((forces[k, i] + dither[k, i]) * 1000.0) / 1000.0
        states[k] = y
        t = t0 + k * dt
        p = plants[np.sum(switches < t + 0.5 * dt)]
        play(p, forces[k], acting[k - 1] if k > 0 else forces[0], acting[k])
        derivative(p, t, y, acting[k], recorded[k] + hidden[k], rate, tensions[k])
        interval(p, k, t, dt, h, y, acting, recorded, hidden, tap_at, taps[k], work)
    return states, forces, tensions, measured
