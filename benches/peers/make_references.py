"""Makes the references of the bench: the motions of its cases, by another program.

The equations are those of the tests' plant in Python, which shares no code with the product. The
method is Gragg's, extrapolated (W. B. Gragg, R. Bulirsch, J. Stoer; Hairer, Nørsett, Wanner,
Solving Ordinary Differential Equations I, section II.9), in steps of a fixed size that end where
forces change and where cables go slack or taut. States are sums of two numbers, so that adding up
steps costs no digits. Each motion is made twice, at order 14 and at order 12 in half as long steps;
the second is kept, with the largest difference of the two for its error.

Run in the project's folder, with `tests` on PYTHONPATH: python benches/peers/make_references.py
[NAME ...]. It takes some minutes.
"""

import sys
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from reference.parameters import Effect, Parameters
from reference.plant import Plant

FOLDER = Path(__file__).parent / "references"
NONE = np.zeros(3)


# ---- method


def gragg(f, t, change, h, n):
    """The midpoint rule in `n` (even) parts of a step, smoothed."""
    part = h / n
    before, now = change, change + part * f(t, change)
    for k in range(1, n):
        before, now = now, before + 2.0 * part * f(t + k * part, now)
    return 0.5 * (before + now + part * f(t + h, now))


def step(f, t, h, size, columns):
    """The change over a step, of order `2 columns`."""
    table = []
    for j in range(columns):
        row = [gragg(f, t, np.zeros(size), h, 2 * (j + 1))]
        for k in range(j):
            ratio = ((j + 1) / (j - k)) ** 2
            row.append(row[k] + (row[k] - table[j - 1][k]) / (ratio - 1.0))
        table.append(row)
    return table[-1][-1]


class Sum:
    """A state as an unevaluated sum of two numbers."""

    def __init__(self, high):
        self.high, self.low = np.array(high, dtype=float), np.zeros(len(high))

    def add(self, change):
        """Takes up a change."""
        change = change + self.low
        total = self.high + change
        part = total - self.high
        self.low = (self.high - (total - part)) + (change - part)
        self.high = total

    def plus(self, change):
        """The state moved by a change, rounded."""
        return self.high + (self.low + change)


# ---- cables that go slack


class Held(Plant):
    """A plant whose cables are taken as taut or slack as `taut` says."""

    taut = None

    def _margins(self, t, y, m):
        length, rate = y[self.lengths], y[self.length_rates]
        spring = self.spring_force(m.L, length)
        pulled = spring + self.bl / length * (m.L_rate - rate)
        return pulled, np.where(spring > 0.0, pulled, spring)

    def _carried(self, t, y, m):
        return np.where(self.taut, self._margins(t, y, m)[0], 0.0)

    def crossed(self, t, y):
        """Which cables are no longer what they are taken for."""
        margin = self._margins(t, y, self.motion(y[0:3], y[3:6]))[1]
        return (margin > 0.0) != self.taut


def advance(plant, state, t, h, force, columns):
    """A step under held forces, which changes over where cables go slack or taut."""

    def f(time, change):
        return plant.evaluate(time, state.plus(change), force, NONE)[0]

    left = h
    while left > 0.0:
        change = step(f, t, left, plant.size, columns)
        if not (isinstance(plant, Held) and plant.crossed(t, state.plus(change)).any()):
            state.add(change)
            return
        low, high = 0.0, left
        while high - low > 1e-15:
            middle = 0.5 * (low + high)
            if plant.crossed(t, state.plus(step(f, t, middle, plant.size, columns))).any():
                high = middle
            else:
                low = middle
        state.add(step(f, t, high, plant.size, columns))
        plant.taut = plant.taut ^ plant.crossed(t, state.plus(0.0))
        t, left = t + high, left - high


# ---- cases


@dataclass
class Case:
    """A motion: `force(plant)` gives `force(k, y)` (N), which is held from the time `k hold` on."""

    plant: Plant
    pose: tuple
    duration: float
    hold: float
    force: object
    step: float
    samples: int


def weave(k, _):
    w = 200.0 * np.sin(0.5 * (0.1 * k))
    return np.array([2e4 + w, 2e4 - w, 2e4 + w, 2e4 - w])


def released(_k, _y):
    return np.full(4, 1e3)


def let_go(k, _):
    pull = 0.0 if k % 4 == 0 else 2e4
    return np.array([pull, 2e4, pull, 2e4])


def jumps(k, _):
    side = 500.0 if k % 2 == 0 else -500.0
    return np.array([2e4 + side, 2e4 - side, 2e4 + side, 2e4 - side])


class Control:
    """The loop of `benches/step/circle.rs`."""

    def __init__(self, plant):
        self.plant, self.feedback = plant, np.zeros(3)

    def __call__(self, k, y):
        radius, w = 5.0, 2.0 * np.pi / 60.0
        phase = w * 0.01 * k
        angle = phase - np.sin(phase)
        rate, bend = w * (1.0 - np.cos(phase)), w * w * np.sin(phase)
        out = radius * np.array([np.cos(angle), np.sin(angle), 0.0])
        on = radius * np.array([-np.sin(angle), np.cos(angle), 0.0])
        acceleration = bend * on - rate * rate * out
        wanted = 0.4 * (0.4 * (out - y[0:3]) + 2.0 * 0.8 * (rate * on - y[3:6]))
        self.feedback = self.feedback + (1.0 - np.exp(-0.01 / 0.3)) * (wanted - self.feedback)
        wrench = np.array([2822.0, 2822.0, 3.89e5]) * (acceleration + self.feedback)
        m = self.plant.motion(y[0:3], np.zeros(3))
        structure = -np.array([m.S.real, m.S.imag, (m.arm.conj() * m.S).imag])
        pretension = np.full(4, 2e4)
        return pretension + np.linalg.pinv(structure) @ (wrench - structure @ pretension)


def cases():
    short = Parameters(anchor_radius=90.0, attachment_radius=1.0)
    six = [
        ("winch_lag", {"time_constant": 0.05}),
        ("winch_coulomb_friction", {"force": 250.0, "transition_speed": 0.01}),
        ("platform_quadratic_drag", {"coefficient": 20.0}),
        ("cable_drag", {"drag_area_per_length": 0.02}),
        ("platform_mass", {"mass": 200.0}),
        ("winch_force_gain", {"factor": 0.97}),
    ]
    effects = tuple(Effect(name, None, values) for name, values in six)
    tenth, start = (0.1, 0.1, 0.1), (5.0, 0.0, 0.0)

    def of_time(force):
        return lambda _plant: force

    return {
        "release": Case(Plant(Parameters()), tenth, 20.0, 1e3, of_time(released), 0.02, 10),
        "circle": Case(Plant(Parameters()), start, 60.0, 0.01, Control, 0.01, 10),
        "let_go": Case(Held(Parameters()), tenth, 4.0, 0.5, of_time(let_go), 0.0025, 10),
        "jumps": Case(
            Plant(Parameters(cable_model="massless_spring")),
            tenth,
            5.0,
            0.5,
            of_time(jumps),
            0.001,
            10,
        ),
        "short_cables": Case(Plant(short), (0.01,) * 3, 5.0, 0.1, of_time(weave), 0.005, 10),
        "six_effects": Case(
            Plant(Parameters(effects=effects)), tenth, 10.0, 0.1, of_time(weave), 0.005, 10
        ),
    }


def run(case, size, columns):
    """Samples of a case in steps of `size` (s): time, pose and unstretched lengths."""
    plant, force_at = case.plant, case.force(case.plant)
    first = case.force(plant)(0, np.concatenate([case.pose, np.zeros(3)]))
    state = Sum(plant.initial_state(case.pose, np.zeros(3), first))
    if isinstance(plant, Held):
        plant.taut = np.full(4, True)
        plant.taut = ~plant.crossed(0.0, state.high)
    count = round(case.duration / size)
    held = max(1, round(case.hold / size))
    samples = []
    for k in range(count):
        if k % held == 0:
            force = force_at(k // held, state.high)
            if isinstance(plant, Held):
                plant.taut = plant.taut ^ plant.crossed(k * size, state.high)
        advance(plant, state, k * size, size, force, columns)
        if (k + 1) % (count // case.samples) == 0:
            seen = np.concatenate([state.high[0:3], state.high[plant.lengths]])
            samples.append([(k + 1) * size, *seen])
    return np.array(samples)


def main():
    for name, case in cases().items():
        if len(sys.argv) > 1 and name not in sys.argv[1:]:
            continue
        coarse, fine = run(case, case.step, 7), run(case, 0.5 * case.step, 6)
        arm = case.plant.parameters.attachment_radius
        error = np.abs(coarse - fine)[:, 1:] * np.array([1.0, 1.0, arm, 1.0, 1.0, 1.0, 1.0])
        lines = [
            f"# {name}, in steps of {0.5 * case.step:g} s; error (m): {error.max():.1e}",
            "# time (s), x, y (m), phi (rad), unstretched lengths (m)",
        ]
        lines += [
            " ".join(repr(float(value)) for value in [round(row[0], 9), *row[1:]]) for row in fine
        ]
        FOLDER.mkdir(exist_ok=True)
        (FOLDER / f"{name}.txt").write_text("\n".join(lines) + "\n")
        print(lines[0], flush=True)


if __name__ == "__main__":
    main()
