"""A point on four rigid cables, as robots that draw on walls are built, simulated by itself.

No code of the product is in it. With `u_i` the direction of cable i away from its anchor, `l_i` its
length, `F_i` the force of its winch and `m_r` the rotor as a mass along the cable, cable i pulls
with `T_i = F_i + m_r l_i''`, and the point moves by `m a = m g + w - sum_i T_i u_i`, where
`l_i'' = u_i . a + (|v|^2 - l_i'^2) / l_i`.
"""

from __future__ import annotations

import numpy as np

ANCHORS = np.array([[1.475, -1.15], [1.475, 1.15], [-1.475, 1.15], [-1.475, -1.15]])
MASS, DRUM, ROTOR = 0.5, 0.0127, 0.000196
GRAVITY = np.array([0.0, -9.81])
CABLES = range(1, 5)

#: Where anchors are (m) beside where the model has them, and what lengths count from.
ANCHORS_OFF = np.array([[0.008, -0.011], [-0.012, 0.006], [0.009, 0.010], [-0.007, -0.012]])
ZEROS_OFF = np.array([0.021, -0.014, 0.017, -0.024])

MODEL = f"""cable_model = "rigid"
cable_inertia = "none"
platform_mass = {MASS}
platform_inertia = 0.001  # no cable turns a point
gravity = [0.0, -9.81]

[winch]
drum_radius = {DRUM}
rotor_inertia = {ROTOR}
""" + "".join(f"\n[[cable]]\nanchor = [{x}, {y}]\nattachment = [0.0, 0.0]\n" for x, y in ANCHORS)

STEP = 1e-3  # s, of the simulation
# Steps between commands, and between rows: half of the commands are in no row.
CONTROL, LOG = 10, 20


def record(seed, *, wind=(0.0, 0.0), bias=0.0, off=0.0, duration=60.0):
    """Rows of time, four winch forces (N) and four lengths (m, to 2 mm) of a point along waves.

    `wind` (N) acts on it, each winch pulls by `bias` (N) more than it is told, and the
    geometry is `off` by so many times the above.
    """
    random = np.random.default_rng(seed)
    anchors = ANCHORS + off * ANCHORS_OFF
    rotor = ROTOR / DRUM**2
    rate, phase = random.uniform(0.3, 1.1, (3, 2)), random.uniform(0.0, 2.0 * np.pi, (3, 2))
    amplitude = np.array([0.3, 0.25, 0.15])[:, None] * np.array([1.2, 0.9])

    def wanted(time):
        return (amplitude * np.sin(rate * time + phase)).sum(axis=0) * min(1.0, time / 3.0)

    point, speed, command, rows = np.zeros(2), np.zeros(2), np.zeros(4), []
    for step in range(round(duration / STEP)):
        time = step * STEP
        away = point - anchors
        length = np.linalg.norm(away, axis=1)
        along = away / length[:, None]
        length_rate = along @ speed
        inertia = MASS * np.eye(2) + rotor * along.T @ along
        if step % CONTROL == 0:
            ahead = (wanted(time + 0.01) - wanted(time)) / 0.01
            asked = (
                inertia @ (60.0 * (wanted(time) - point) + 15.0 * (ahead - speed)) - MASS * GRAVITY
            )
            usual = np.full(4, 25.0)
            command = np.clip(
                usual - np.linalg.pinv(along.T) @ (asked + along.T @ usual), 3.0, 200.0
            )
        if step % LOG == 0:
            shown = length + off * ZEROS_OFF + 1e-3 * random.standard_normal(4)
            rows.append((time, *command, *np.round(shown / 2e-3) * 2e-3))
        pull = command + bias + rotor * (speed @ speed - length_rate**2) / length
        acceleration = np.linalg.solve(inertia, MASS * GRAVITY + np.asarray(wind) - along.T @ pull)
        speed = speed + STEP * acceleration
        point = point + STEP * speed
    return np.array(rows)


def write(folder, rows):
    """The model as `model.toml` and a recording as `run.csv`."""
    (folder / "model.toml").write_text(MODEL, encoding="utf-8")
    names = [
        "time",
        *(f"winch_force[{i}]" for i in CABLES),
        *(f"cable_length[{i}]" for i in CABLES),
    ]
    np.savetxt(
        folder / "run.csv", rows, delimiter=",", header=",".join(names), comments="", fmt="%.6g"
    )
