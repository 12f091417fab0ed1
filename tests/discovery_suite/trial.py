"""One trial: what is asked of the robot, what its sensors read, and the CSV file."""

from dataclasses import dataclass, field, replace
from pathlib import Path

import numpy as np
from scipy.signal import bilinear, lfilter

from . import imperfections, parameters
from .control import closed_loop
from .imperfections import NONE, Imperfections
from .plant import layout, lengths
from .robot import TELESCOPE, Robot


@dataclass(frozen=True)
class Settings:
    """How a trial is run and recorded. Lengths m, angles rad, forces N, times s."""

    seed: int
    duration: float = 100.0
    rate: float = 50.0
    pretension: float = 20e3
    pretension_swing: float = 0.0  # amplitude of a slow two-tone change of the mean tension
    pretension_step: float = 0.0  # change of the mean tension, made over 5 s at 40 % of the trial
    centre: tuple = (0.0, 0.0, 0.0)
    amplitude: float = 3.0  # peak of the reference in x and in y
    rotation: float = 0.06  # peak of the reference in phi
    slowest: float = 0.015  # Hz, lowest and highest tone of the reference
    fastest: float = 0.16
    lead_in: float = 0.0  # run this long before the record starts
    dither: float = 0.0  # peak of a multi-sine added to each winch force, 0.2 to 2 Hz
    wind: float = 0.0  # rms of a recorded disturbance force (the torque has 5 m of arm)
    turbulence: float = 0.0  # rms of an unrecorded Dryden gust force
    pose_noise: float = 5e-3
    angle_noise: float = 5e-5
    length_noise: float = 2e-3
    tension_noise: float = 20.0
    channels: tuple = ("x", "y", "phi", "unstretched_length")
    gaps: float = 0.0  # share of readings lost, in runs
    outliers: float = 0.0  # share of readings thrown far off
    loop: tuple = (0.5, 0.8, 2.5)  # loop frequency (rad/s), damping, observer frequency (rad/s)
    imperfections: Imperfections = NONE  # of what is written, beside white noise
    robot: Robot = TELESCOPE
    settling: float = 8.0  # s, in which the reference begins to move
    tones: tuple = ((0.2, 2.0), (0.02, 0.07))  # Hz, slowest and fastest of dither and pretension
    plan: str = ""  # table of `cdpr experiment` to follow, in place of a reference that is drawn

    def but(self, **changes):
        """The same trial with these settings changed."""
        return replace(self, **changes)


@dataclass
class Record:
    """What a trial left: the truth and the readings."""

    settings: Settings
    params: np.record
    dt: float
    h: float
    states: np.ndarray
    forces: np.ndarray
    tensions: np.ndarray
    recorded: np.ndarray
    hidden: np.ndarray
    columns: dict = field(default_factory=dict)
    clean: dict = field(default_factory=dict)  # the columns without noise, gaps and outliers
    noise: dict = field(default_factory=dict)


def multisine(rng, t, slowest, fastest, tones, peak):
    """A sum of tones (log-spaced, jittered) of this peak, with two derivatives: (n, 3)."""
    steps = np.linspace(0.0, 1.0, tones) + rng.uniform(-0.06, 0.06, tones)
    omega = 2.0 * np.pi * slowest * (fastest / slowest) ** steps
    phase = rng.uniform(0.0, 2.0 * np.pi, tones)
    gain = rng.uniform(0.7, 1.3, tones) * (omega[0] / omega) ** 0.6
    angle = np.outer(t, omega) + phase
    value = np.sin(angle) @ gain
    first = np.cos(angle) @ (gain * omega)
    second = -np.sin(angle) @ (gain * omega**2)
    scale = peak / max(np.abs(value).max(), 1e-12)
    return scale * np.column_stack([value, first, second])


def fade_in(t, span):
    """A quintic from 0 to 1 over `span`, with two derivatives: (n, 3)."""
    s = np.clip(t / span, 0.0, 1.0)
    value = s**3 * (10.0 - 15.0 * s + 6.0 * s**2)
    first = 30.0 * s**2 * (1.0 - s) ** 2 / span
    second = 60.0 * s * (1.0 - s) * (1.0 - 2.0 * s) / span**2
    return np.column_stack([value, first, second])


def reference(rng, settings, t):
    """Reference pose, rate and acceleration, (n, 3, 3), at rest at the start."""
    gate = fade_in(t - t[0], settings.settling)
    out = np.empty((t.size, 3, 3))
    for axis in range(3):
        peak = settings.rotation if axis == 2 else settings.amplitude
        wave = multisine(rng, t, settings.slowest, settings.fastest, 6, peak)
        out[:, 0, axis] = settings.centre[axis] + gate[:, 0] * wave[:, 0]
        out[:, 1, axis] = gate[:, 1] * wave[:, 0] + gate[:, 0] * wave[:, 1]
        out[:, 2, axis] = (
            gate[:, 2] * wave[:, 0] + 2.0 * gate[:, 1] * wave[:, 1] + gate[:, 0] * wave[:, 2]
        )
    return out


def dryden(rng, n, dt, rms, time_scale=6.0):
    """Dryden gusts (N): longitudinal in x, transverse in y, and a torque of 2 m of arm."""
    warm_up = int(5.0 * time_scale / dt)
    out = np.zeros((n, 3))
    for axis in range(3):
        if axis == 0:
            top, bottom = [1.0], [time_scale, 1.0]
        else:
            top = [np.sqrt(3.0) * time_scale, 1.0]
            bottom = [time_scale**2, 2.0 * time_scale, 1.0]
        b, a = bilinear(top, bottom, fs=1.0 / dt)
        wave = lfilter(b, a, rng.standard_normal(n + warm_up))[warm_up:]
        out[:, axis] = rms * wave / wave.std() * (2.0 if axis == 2 else 1.0)
    return out


def disturbances(rng, settings, t, dt):
    """Recorded (n, 3) disturbances, held and rounded to 1 mN, and hidden (n + 1, 3) ones."""
    recorded = np.zeros((t.size, 3))
    if settings.wind > 0.0:
        for axis in range(3):
            wave = multisine(rng, t, 0.01, 0.3, 7, 1.0)[:, 0]
            size = settings.wind * (5.0 if axis == 2 else 1.0)
            recorded[:, axis] = np.round(size * wave / wave.std(), 3)
    hidden = np.zeros((t.size + 1, 3))
    if settings.turbulence > 0.0:
        hidden = dryden(rng, t.size + 1, dt, settings.turbulence)
    return recorded, hidden


def _pretension(rng, settings, t):
    """Mean tension over time."""
    mean = np.full(t.size, settings.pretension)
    if settings.pretension_swing:
        wave = multisine(rng, t, *settings.tones[1], 2, settings.pretension_swing)[:, 0]
        mean += fade_in(t - t[0], settings.settling)[:, 0] * wave
    if settings.pretension_step:
        start = t[0] + 0.4 * (t[-1] - t[0])
        mean += settings.pretension_step * fade_in(t - start, 5.0)[:, 0]
    return mean


def planned(path, samples):
    """Reference (samples, 3, 3) and mean winch force (samples) of a plan; held before and after."""
    names = Path(path).read_text(encoding="utf-8").split("\n", 1)[0].split(",")
    rows = np.loadtxt(path, delimiter=",", skiprows=1)
    column = dict(zip(names, rows.T, strict=True))
    motion = [("x", "y", "phi"), ("vx", "vy", "omega"), ("ax", "ay", "alpha")]
    reference = np.stack([np.stack([column[n] for n in axes], 1) for axes in motion], 1)
    forces = [values for name, values in column.items() if name.startswith("winch_force")]
    mean = np.mean(forces, axis=0)
    lead = samples - len(rows)
    if lead < 0:
        raise ValueError(f"{path}: found {len(rows)} rows, expected at most {samples}")
    return np.pad(reference, ((lead, 0), (0, 0), (0, 0)), "edge"), np.pad(mean, (lead, 0), "edge")


@dataclass
class Plan:
    """What a trial asks of the robot, sample by sample; `lead` samples come before the record."""

    dt: float
    lead: int
    t: np.ndarray
    reference: np.ndarray
    pretension: np.ndarray
    pose_errors: np.ndarray
    dither: np.ndarray
    recorded: np.ndarray
    hidden: np.ndarray
    sensor_rng: np.random.Generator
    loss_rng: np.random.Generator


def plan(settings):
    """Draw everything random of a trial."""
    # Separate streams, so that a change of one setting leaves the other draws alone.
    streams = np.random.SeedSequence(settings.seed).spawn(6)
    r_ref, r_dist, r_noise, r_dither, r_pre, r_loss = map(np.random.default_rng, streams)
    dt = 1.0 / settings.rate
    lead = round(settings.lead_in * settings.rate)
    n = lead + round(settings.duration * settings.rate) + 1
    t = dt * (np.arange(n) - lead)
    recorded, hidden = disturbances(r_dist, settings, t, dt)
    pose_sigma = np.array([settings.pose_noise, settings.pose_noise, settings.angle_noise])
    pose_errors = r_noise.standard_normal((n, 3)) * pose_sigma
    cables = settings.robot.cables
    dither = np.zeros((n, cables))
    if settings.dither > 0.0:
        gate = fade_in(t - t[0], 5.0)[:, 0]
        for i in range(cables):
            wave = multisine(r_dither, t, *settings.tones[0], 8, settings.dither)[:, 0]
            dither[:, i] = gate * wave
    if settings.plan:
        wanted, mean = planned(settings.plan, n)
    else:
        wanted, mean = reference(r_ref, settings, t), _pretension(r_pre, settings, t)
    return Plan(dt, lead, t, wanted, mean, pose_errors, dither, recorded, hidden, r_noise, r_loss)


def run(settings, effects=(), cable_model="lumped_mass", step_scale=1.0):
    """Run one trial and read its sensors. `step_scale` < 1 refines the integration (for tests)."""
    plants, switches = parameters.build_in_time(effects, cable_model, settings.robot)
    asked = plan(settings)
    bias, delay, frame = np.zeros(3), 0.0, np.zeros(4)
    for effect in effects:
        if effect["id"] == "pose_sensor_bias":
            bias += [effect["parameters"][axis] for axis in ("x", "y", "phi")]
        elif effect["id"] == "pose_sensor_frame":
            frame[:3] += [effect["parameters"].get(name, 0.0) for name in ("angle", "x", "y")]
        elif effect["id"] == "pose_sensor_scale":
            frame[3] += effect["parameters"]["factor"]
        elif effect["id"] == "pose_sensor_delay":
            delay += effect["parameters"]["delay"]
    h = min([1e-3, *map(parameters.step_size, plants)]) * step_scale
    states, forces, tensions, poses = closed_loop(
        plants,
        switches,
        parameters.build((), cable_model, settings.robot),
        asked.t[0],
        asked.dt,
        h,
        asked.reference,
        asked.pretension,
        asked.pose_errors,
        bias,
        frame,
        delay,
        asked.recorded,
        asked.hidden,
        asked.dither,
        np.array(settings.loop),
    )
    return finish(settings, plants[-1], asked, h, states, forces, tensions, poses, effects)


def finish(settings, params, asked, h, states, forces, tensions, poses, effects=()):
    """Check a trial, drop what came before the record, and read the sensors."""
    if (
        not np.isfinite(states).all()
        or np.abs(states[:, 0]).max() > 0.3 * settings.robot.usual_length
    ):
        raise ArithmeticError(f"trial with seed {settings.seed}: the closed loop ran away")
    if tensions.min() <= 0.0:
        raise ArithmeticError(f"trial with seed {settings.seed}: a cable went slack")
    cut = slice(asked.lead, None)
    record = Record(
        settings,
        params,
        asked.dt,
        h,
        states[cut],
        forces[cut],
        tensions[cut],
        asked.recorded[cut],
        asked.hidden[cut],
    )
    _read_sensors(record, poses[cut], asked.pose_errors[cut], effects, asked)
    return record


def counted(paid_out, drum):
    """What an encoder has counted (m) when this much has left a drum off its axis.

    The cable leaves at the lever `r + e sin(angle + phase)`; the count is `r angle`.
    """
    off, radius, phase = (drum[name] for name in ("eccentricity", "drum_radius", "phase"))
    angle = paid_out / radius
    for _ in range(60):
        wave = off * (np.cos(angle + phase) - np.cos(phase))
        angle = (paid_out + wave) / radius
    return radius * angle


def _read_sensors(record, poses, pose_errors, effects, asked):
    """Fill the record's columns and noise levels from its states and the measured poses."""
    settings, n = record.settings, len(record.states)
    rng, loss_rng = asked.sensor_rng, asked.loss_rng
    cables, own, payouts, *_ = layout(record.params)
    chords = np.empty((n, cables))
    for k in range(n):
        lengths(record.params, record.states[k], chords[k])
    truth = {"cable_length": chords, "tension": record.tensions}
    truth["unstretched_length"] = chords if record.params.rigid else record.states[:, own:payouts]
    columns, clean, noise = {}, {}, {}
    for channel in settings.channels:
        if channel in ("x", "y", "phi"):
            columns[channel] = poses[:, ("x", "y", "phi").index(channel)].copy()
            clean[channel] = columns[channel] - pose_errors[:, ("x", "y", "phi").index(channel)]
            noise[channel] = settings.angle_noise if channel == "phi" else settings.pose_noise
            continue
        sigma = settings.tension_noise if channel == "tension" else settings.length_noise
        for i in range(cables):
            reading = truth[channel][:, i].copy()
            for effect in effects:
                off_axis = effect["id"] == "winch_drum_eccentricity"
                by_encoder = channel == "unstretched_length" and effect["cable"] in (None, i + 1)
                if off_axis and by_encoder:
                    reading = counted(reading, effect["parameters"])
                if not effect["id"].startswith(("length_sensor", "tension_sensor")):
                    continue
                p = effect["parameters"]
                usual = "unstretched_length" if effect["id"].startswith("length") else "tension"
                if effect.get("channel", usual) != channel:
                    continue
                if effect["cable"] in (None, i + 1):
                    reading = reading * (1.0 + p.get("factor", 0.0)) + p.get("bias", 0.0)
            name = f"{channel}[{i + 1}]"
            columns[name] = reading + sigma * rng.standard_normal(n)
            clean[name], noise[name] = reading, sigma
    for name, column in columns.items():
        if settings.outliers:
            hit = loss_rng.random(n) < settings.outliers
            size = noise[name] * loss_rng.uniform(8.0, 60.0, n) * loss_rng.choice([-1.0, 1.0], n)
            column[hit] += size[hit]
        if settings.gaps:
            run_length = 12
            starts = np.flatnonzero(loss_rng.random(n) < settings.gaps / run_length)
            for start in starts:
                column[start : start + run_length] = np.nan
    record.columns, record.clean, record.noise = columns, clean, noise


def write_csv(record, path):
    """Write the record as measured data: time, inputs as applied, readings; a gap is empty."""
    written = imperfections.apply(record, record.settings.imperfections)
    names, cells = ["time"], [[f"{t:.6g}" for t in written.time]]
    for i in range(record.settings.robot.cables):
        names.append(f"winch_force[{i + 1}]")
        cells.append([f"{v:.3f}" for v in written.forces[:, i]])
    if record.settings.wind > 0.0:
        for axis, name in enumerate(("force_x", "force_y", "torque")):
            names.append(f"disturbance_{name}")
            cells.append([f"{v:.3f}" for v in record.recorded[:, axis]])
    for name, column in written.columns.items():
        names.append(name)
        digits = 9 if name == "phi" else (3 if name.startswith("tension") else 7)
        cells.append(["" if np.isnan(v) else f"{v:.{digits}f}" for v in column])
    lines = [",".join(names)]
    lines.extend(",".join(row) for row in zip(*cells, strict=True))
    Path(path).write_text("\n".join(lines) + "\n", encoding="utf-8")
