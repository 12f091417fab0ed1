"""Trials on MoorDyn's cables: a second generator whose cable model is not ours at all.

MoorDyn (lumped-mass lines, https://moordyn.readthedocs.io) computes four cables of ten segments
each, in still air and without gravity, in one plane. Fixed points are the anchors, coupled points
the platform's attachments. This module moves the platform and the winches, which are outside its
lines: the winch force acts on the anchor end through a winch mass, and the unstretched length is
changed through MoorDyn's own call, which spreads the change evenly over the segments.

What differs in physics from the plant that the workflow knows:

- The cables have transverse waves (first mode near 0.17 Hz at 20 kN, hardly damped, inside the
  band of the reference); the known model has straight cables with the inertia of a stiff rod.
- Axially the mass is distributed: a third of each cable's mass follows the platform along the
  cable and axial waves (about 100 rad/s) exist; the known model has half of the mass on the winch
  and none at the platform.
- The winch side here is a constant mass, half of the nominal cable's; in the known model it varies
  with the length and has gyroscopic terms.
- Air drag on the cables, with 1.2 times the diameter per length.

Of the catalogue, `cable_transverse_mode` (0.215 kg/m, 0.0271 m) and `cable_axial_mass` (0.215 kg/m)
describe nearly all of this. Of the force across the cables that the known model lacks, the first
leaves 3 to 12 %. Along them the second's half of each cable's mass is here a third at the platform
and a sixth at the winch.

Elastic law, damping, geometry, platform and sensors are the nominal ones. Runs are deterministic.
Halving the step of 1 ms moves the readings of a 40 s trial by at most 3 % of the noise (5 mm, 2 mm,
0.05 mrad); the difference in physics is hundreds of times as large.
"""

import ctypes
import math
import os
import sys
import tempfile
from contextlib import contextmanager
from pathlib import Path

import moordyn
import numpy as np

from . import parameters
from .control import MEMORY, control_step, distribute
from .plant import at_rest, layout, state_count
from .robot import TELESCOPE
from .trial import finish, plan

SEGMENTS = 10
DEPTH = 500.0  # m under MoorDyn's free surface, far from it and from the ground
DIAMETER = math.sqrt(4.0 * 4e-4 / math.pi)  # m, of the cable's area
STEP = 1e-3  # s
WINCH_MASS = 0.5 * TELESCOPE.density * 900.0  # kg

_INPUT = """Planar cable robot
---------------------- LINE TYPES ----------------------
TypeName Diam Mass/m EA BA/-zeta EI Cd Ca CdAx CaAx
(name) (m) (kg/m) (N) (N-s/-) (N-m^2) (-) (-) (-) (-)
cable {diameter:.17g} {density} {stiffness:.17g} {damping} 0 1.2 0 0 0
---------------------- POINTS ----------------------
Node Type X Y Z M V CdA CA
(-) (-) (m) (m) (m) (kg) (m^3) (m^2) (-)
{points}
---------------------- LINES ----------------------
Line LineType NodeA NodeB UnstrLen NumSegs LineOutputs
(-) (-) (-) (-) (m) (-) (-)
{lines}
---------------------- OPTIONS ----------------------
{step} dtM
rk4 tScheme
0 g
{air} rho
1000 WtrDpth
0.001 dtIC
0.002 TmaxIC
0 writeLog
1 disableOutput
1 disableOutTime
---------------------- OUTPUTS ----------------------
--------------------- need this line ----------------------
"""


@contextmanager
def _silence():
    """Keep MoorDyn's start-up talk, which it prints past Python, off the terminal."""
    sys.stdout.flush()
    sys.stderr.flush()
    kept = [os.dup(1), os.dup(2)]
    with open(os.devnull, "wb") as nowhere:
        try:
            os.dup2(nowhere.fileno(), 1)
            os.dup2(nowhere.fileno(), 2)
            yield
        finally:
            for target, copy in zip((1, 2), kept, strict=True):
                os.dup2(copy, target)
                os.close(copy)


def _keep_none():
    """Give None the reference that MoorDyn 2.7.2's setters forget to take before returning it.

    Without it Python before 3.12 aborts after some thousands of calls, when None's count is spent.
    """
    ctypes.pythonapi.Py_IncRef(ctypes.py_object(None))


class Cables:
    """Four MoorDyn lines between the anchors and the platform."""

    def __init__(self, params, pose, unstretched, step):
        self.anchors = np.array(TELESCOPE.anchors)
        ends = attachments(params, pose)
        points = [f"{i + 1} Fixed {a[0]:.17g} {a[1]:.17g}" for i, a in enumerate(self.anchors)]
        points += [f"{i + 5} Coupled {b[0]:.17g} {b[1]:.17g}" for i, b in enumerate(ends)]
        lines = [
            f"{i + 1} cable {i + 1} {i + 5} {length:.17g} {SEGMENTS} -"
            for i, length in enumerate(unstretched)
        ]
        text = _INPUT.format(
            diameter=DIAMETER,
            density=TELESCOPE.density,
            stiffness=TELESCOPE.stiffness,
            damping=TELESCOPE.damping,
            points="\n".join(f"{p} {-DEPTH} 0 0 0 0" for p in points),
            lines="\n".join(lines),
            step=step,
            air=parameters.AIR_DENSITY,
        )
        with tempfile.TemporaryDirectory() as folder:
            path = Path(folder) / "lines.txt"
            path.write_text(text, encoding="utf-8")
            with _silence():
                self.system = moordyn.Create(str(path))
                failed = moordyn.Init(self.system, _spatial(ends, -DEPTH), [0.0] * 12)
            if failed:
                raise RuntimeError("MoorDyn: the lines could not be initialised")
        self.lines = [moordyn.GetLine(self.system, i + 1) for i in range(TELESCOPE.cables)]

    def step(self, t, step, ends, rates, unstretched, unstretched_rates):
        """Move the ends from `ends` at `rates` over one step; the forces on them, (4, 2).

        MoorDyn moves the ends and the unstretched lengths along at constant rates by itself.
        """
        for line, length, rate in zip(self.lines, unstretched, unstretched_rates, strict=True):
            moordyn.SetLineUnstretchedLength(line, float(length))
            _keep_none()
            moordyn.SetLineUnstretchedLengthVel(line, float(rate))
            _keep_none()
        forces = moordyn.Step(self.system, _spatial(ends, -DEPTH), _spatial(rates, 0.0), t, step)
        return np.asarray(forces).reshape(4, 3)[:, :2]

    def anchor_tensions(self):
        """Tension (N) of each cable's first segment, at its winch."""
        return np.array([math.hypot(*moordyn.GetLineNodeTen(line, 0)) for line in self.lines])

    def close(self):
        """Free MoorDyn's memory."""
        with _silence():
            moordyn.Close(self.system)


def _spatial(plane, z):
    """Plane points or rates (4, 2) as MoorDyn's flat list of twelve."""
    out = np.full((4, 3), z)
    out[:, :2] = plane
    return out.ravel().tolist()


def _arms(params, phi):
    """Attachments relative to the platform's centre, (4, 2)."""
    cos, sin = math.cos(phi), math.sin(phi)
    body_x, body_y = np.array(TELESCOPE.attachments).T
    x = cos * body_x - sin * body_y
    y = sin * body_x + cos * body_y
    return np.column_stack([x, y])


def attachments(params, pose):
    """Where the cables meet the platform, (4, 2)."""
    return pose[:2] + _arms(params, pose[2])


def run(settings, step=STEP):
    """Run one trial on MoorDyn's cables and read its sensors.

    Platform and winches are moved by the velocity Verlet rule: half a kick, a drift through which
    MoorDyn moves its lines at constant end velocity, and half a kick by the forces it returns.
    """
    params = parameters.build()
    asked = plan(settings)
    n = len(asked.t)
    states, forces = np.zeros((n, state_count(params))), np.zeros((n, TELESCOPE.cables))
    tensions, poses = np.zeros_like(forces), np.zeros((n, 3))
    start = asked.reference[0, 0]
    distribute(params, start, 0.0, 0.0, 0.0, asked.pretension[0], forces[0])
    y = at_rest(params, 0.0, start, forces[0])
    pose, rate = y[:3].copy(), np.zeros(3)
    _, own, payouts, lagged, *_ = layout(params)
    length, payout = y[own:payouts].copy(), np.zeros(TELESCOPE.cables)
    memory = np.zeros(MEMORY)
    memory[:3] = start
    gains = np.array(settings.loop)
    # The outermost half segment of each cable hangs on the platform and is not in MoorDyn's force.
    end_mass = 0.5 * TELESCOPE.density * 900.0 / SEGMENTS
    mass = params.mass + 4.0 * end_mass
    inertia = np.array([mass, mass, params.inertia + 4.0 * end_mass * 100.0])
    substeps = round(asked.dt / step)
    step = asked.dt / substeps

    cables = Cables(params, pose, length, step)
    try:
        pull = -_unit(params, cables.anchors, pose) * forces[0][:, None]
        at_winch = forces[0].copy()
        for k in range(n):
            poses[k] = pose + asked.pose_errors[k]
            if k > 0:
                control_step(
                    params,
                    memory,
                    poses[k],
                    asked.reference[k],
                    asked.pretension[k],
                    asked.dt,
                    gains,
                    forces[k],
                )
                forces[k] = np.round(forces[k] + asked.dither[k], 3)
            states[k, :3], states[k, 3:6] = pose, rate
            states[k, own:payouts], states[k, payouts:lagged] = length, payout
            tensions[k] = np.hypot(pull[:, 0], pull[:, 1])
            for j in range(substeps):
                wrench = asked.recorded[k] + asked.hidden[k]
                rate = rate + 0.5 * step * _platform(params, pose, pull, wrench) / inertia
                payout = payout + 0.5 * step * (at_winch - forces[k]) / WINCH_MASS
                before = attachments(params, pose)
                pose = pose + step * rate
                after = attachments(params, pose)
                drift = (after - before) / step
                time = (k * substeps + j) * step
                pull = cables.step(time, step, before, drift, length, payout)
                length = length + step * payout
                # MoorDyn damps the rate of a segment's length, also where that is cable paid out.
                # What it adds so is the same all along the cable, and is taken off at both ends.
                surplus = TELESCOPE.damping / length * payout
                pull += surplus[:, None] * _unit(params, cables.anchors, pose)
                at_winch = cables.anchor_tensions() - surplus
                rate = rate + 0.5 * step * _platform(params, pose, pull, wrench) / inertia
                payout = payout + 0.5 * step * (at_winch - forces[k]) / WINCH_MASS
    finally:
        cables.close()
    return finish(settings, params, asked, step, states, forces, tensions, poses)


def _unit(params, anchors, pose):
    """Unit vectors from the anchors to the attachments, (4, 2)."""
    along = attachments(params, pose) - anchors
    return along / np.hypot(along[:, 0], along[:, 1])[:, None]


def _platform(params, pose, pull, wrench):
    """Wrench at the platform's centre from the cables' forces and a disturbance."""
    arms = _arms(params, pose[2])
    torque = arms[:, 0] * pull[:, 1] - arms[:, 1] * pull[:, 0]
    return wrench + np.array([pull[:, 0].sum(), pull[:, 1].sum(), torque.sum()])
