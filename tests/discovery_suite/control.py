"""A pose controller of the ordinary kind: observer, PD with feed-forward, tension distribution.

It knows the plant's nominal geometry and mass only, and reads the noisy pose sensor at the record
rate. Its forces are held between samples, so the recorded winch forces are what the plant received.
It must hold the rotation: equal tension in crossed cables is unstable there.
"""

import math

import numpy as np
from numba import njit

from .plant import STATES, at_rest, derivative, interval, split_delay

# What a control engineer would feed forward: platform plus the share of four cables (kg, kg m2).
FEED_MASS = 2820.0
FEED_INERTIA = 3.7e5


@njit(cache=True, error_model="numpy")
def distribute(p, pose, force_x, force_y, torque, mean, out):
    """Four tensions (N) of this mean that give a wrench at a pose; rounded to 1 mN as a drive does.

    The structure matrix has one null direction; the minimum-norm answer is moved along it.
    """
    cos, sin = math.cos(pose[2]), math.sin(pose[2])
    a = np.empty((3, 4))
    for i in range(4):
        ex = cos * p.body_x[i] - sin * p.body_y[i]
        ey = sin * p.body_x[i] + cos * p.body_y[i]
        dx, dz = pose[0] + ex - p.anchor_x[i], pose[1] + ey - p.anchor_y[i]
        chord = math.sqrt(dx * dx + dz * dz)
        a[0, i], a[1, i] = -dx / chord, -dz / chord
        a[2, i] = (ex * a[1, i] - ey * a[0, i]) / 10.0
    wanted = np.array([force_x, force_y, torque / 10.0])
    base = a.T @ np.linalg.solve(a @ a.T, wanted)
    null = np.empty(4)
    for i in range(4):
        minor = np.empty((3, 3))
        column = 0
        for j in range(4):
            if j != i:
                minor[:, column] = a[:, j]
                column += 1
        null[i] = (-1.0) ** i * np.linalg.det(minor)
    share = (mean - base.mean()) / null.mean()
    for i in range(4):
        tension = min(max(base[i] + share * null[i], 200.0), 1.2e5)
        out[i] = round(tension * 1000.0) / 1000.0


# What the controller remembers: seen pose, seen rate, wrench it asked for.
MEMORY = 9


@njit(cache=True, error_model="numpy")
def control_step(model, memory, measured, wanted, pretension, dt, gains, out):
    """One sample of the controller: `out` gets the four winch forces (N).

    `measured` is the pose read now, `wanted` (3, 3) the reference pose, rate and acceleration,
    `gains` the loop's frequency (rad/s), its damping and the observer's frequency (rad/s).
    `memory` is updated.
    """
    inertia = np.array([FEED_MASS, FEED_MASS, FEED_INERTIA])
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
def closed_loop(
    p, model, t0, dt, h, reference, pretension, noise, bias, delay, recorded, hidden, dither, gains
):
    """Run a trial of `n` samples in closed loop from rest at the first reference pose.

    `reference` (n, 3, 3) holds pose, its rate and acceleration; `pretension` (n) the mean tension;
    `noise` (n, 3), `bias` (3) and `delay` (s) act on the pose sensor; `recorded` (n, 3) and
    `hidden` (n + 1, 3) are disturbances; `dither` (n, 4) is added to the forces. `p` is the plant,
    `model` what the controller believes. Returns states (n, 26), winch forces (n, 4), tensions
    (n, 4) and measured poses (n, 3).
    """
    n = len(reference)
    states = np.empty((n, STATES))
    forces = np.zeros((n, 4))
    tensions = np.empty((n, 4))
    measured = np.empty((n, 3))
    taps = np.empty((n, 3))
    work = np.zeros((7, STATES))
    rate = np.zeros(STATES)
    memory = np.zeros(MEMORY)
    memory[:3] = reference[0, 0]
    whole, rest = split_delay(delay, dt)
    tap_at = dt - rest if rest > 0.0 else 0.0
    distribute(model, reference[0, 0], 0.0, 0.0, 0.0, pretension[0], forces[0])
    y = at_rest(p, t0, reference[0, 0], forces[0])
    for k in range(n):
        # Sensor: the pose now, or the one tapped `delay` ago (the pose at rest before the start).
        pose = y[:3]
        if whole > 0 or rest > 0.0:
            # Interval j was tapped at t_j + dt - rest, or at t_j itself when nothing is left over.
            j = k - whole - (1 if rest > 0.0 else 0)
            pose = taps[j] if j >= 0 else reference[0, 0]
        measured[k] = pose + bias + noise[k]
        if k > 0:
            control_step(
                model, memory, measured[k], reference[k], pretension[k], dt, gains, forces[k]
            )
            for i in range(4):
                forces[k, i] = round((forces[k, i] + dither[k, i]) * 1000.0) / 1000.0
        states[k] = y
        t = t0 + k * dt
        derivative(p, t, y, forces[k], recorded[k] + hidden[k], rate, tensions[k])
        interval(p, k, t, dt, h, y, forces, recorded, hidden, tap_at, taps[k], work)
    return states, forces, tensions, measured
