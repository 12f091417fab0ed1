"""Parameters, effects and inputs of the reference plant (SI units, radians)."""

from __future__ import annotations

import bisect
import math
from dataclasses import dataclass, field

import numpy as np

RIGID = "rigid"
MASSLESS_SPRING = "massless_spring"
LUMPED_MASS = "lumped_mass"
CABLE_MODELS = (RIGID, MASSLESS_SPRING, LUMPED_MASS)
CABLE_INERTIAS = ("paper", "reeled", "none")

CABLES = 4  # of the robot of the paper
AIR_DENSITY = 1.225  # kg/m3, ISA sea level


def _degrees(*angles: float) -> tuple[float, ...]:
    return tuple(math.radians(a) for a in angles)


@dataclass(frozen=True)
class Effect:
    """One entry of the catalogue: `cable` counts from 1, or None for all or for the platform."""

    id: str
    cable: int | None = None
    values: dict[str, float | str] = field(default_factory=dict)

    def acts_on(self, cable_index: int) -> bool:
        """Whether it acts on the cable with this zero-based index."""
        return self.cable is None or self.cable == cable_index + 1

    @property
    def switches(self) -> list[float]:
        """When it begins or ends (s)."""
        return [self.values[key] for key in ("from", "until") if key in self.values]

    def in_force(self, t: float) -> bool:
        """Whether it is there at this time."""
        return self.values.get("from", -math.inf) <= t < self.values.get("until", math.inf)


@dataclass(frozen=True)
class Cable:
    """One cable by coordinates (m); `own` holds what it has other than the robot's."""

    anchor: tuple[float, float]
    attachment: tuple[float, float]
    own: dict[str, float] = field(default_factory=dict)


@dataclass(frozen=True)
class Parameters:
    """Tables I and II of the paper, with the area in m2 and everything changeable."""

    platform_mass: float = 2500.0  # kg
    platform_inertia: float = 3.5e5  # kg m2, about the centre of mass
    anchor_radius: float = 900.0  # m
    attachment_radius: float = 10.0  # m
    anchor_angle: tuple[float, ...] = _degrees(-135, -45, 45, 135)
    attachment_angle: tuple[float, ...] = _degrees(-45, -135, 135, 45)
    cable_density: float = 0.215  # kg/m
    youngs_modulus: float = 38e9  # Pa
    cable_area: float = 4e-4  # m2
    cable_damping: float = 20000.0  # N s, the product b l
    cable_model: str = LUMPED_MASS
    cable_inertia: str = "paper"
    effects: tuple[Effect, ...] = ()
    gravity: tuple[float, float] = (0.0, 0.0)  # m/s2
    centre_of_mass: tuple[float, float] = (0.0, 0.0)  # m, body frame
    cable: tuple[Cable, ...] = ()  # in place of the two circles
    winch: dict[str, float | str] = field(default_factory=dict)  # other than `WINCH`

    @property
    def cables(self) -> int:
        """Number of cables."""
        return len(self.cable) or len(self.anchor_angle)

    def each(self, own: str, common: float) -> np.ndarray:
        """A property of every cable: its own, or the robot's."""
        if not self.cable:
            return np.full(self.cables, common)
        return np.array([c.own.get(own, common) for c in self.cable])

    @property
    def command(self) -> str:
        """What the winches are told: force, torque, speed or length."""
        return self.winch.get("command", "force")

    def of_winches(self, name: str) -> np.ndarray:
        """A property of every winch: a drum, gear or rotor of its own, or what all have."""
        common = self.winch.get(name, WINCH[name])
        if name in ("drum_radius", "gear_ratio", "rotor_inertia"):
            return self.each(name, common)
        return np.full(self.cables, common)

    @property
    def axial_stiffness(self) -> float:
        """EA in N."""
        return self.youngs_modulus * self.cable_area

    def find(self, effect_id: str) -> list[Effect]:
        """All effects with this id."""
        return [e for e in self.effects if e.id == effect_id]

    def to_toml(self) -> str:
        """The same model as a `model.toml`, every value written with all its digits."""
        lines = []
        circles = ("anchor_radius", "attachment_radius")
        for name in SCALARS:
            if not (self.cable and name in circles):
                lines.append(f"{name} = {_number(getattr(self, name))}")
        rows = ["gravity", "centre_of_mass"]
        rows += [] if self.cable else ["anchor_angle", "attachment_angle"]
        for name in rows:
            lines.append(f"{name} = {_row(getattr(self, name))}")
        lines.append(f'cable_model = "{self.cable_model}"')
        lines.append(f'cable_inertia = "{self.cable_inertia}"')
        if self.cable:
            # Without a start of its own a model is refused where no winch holds it.
            start = [1000.0] * self.cables
            if self.command == "force":
                lines += ["", "[start]", f"winch_force = {_row(start)}"]
        if self.winch:
            lines += ["", "[winch]"]
            lines += [f"{key} = {_value(value)}" for key, value in self.winch.items()]
        for cable in self.cable:
            lines += ["", "[[cable]]", f"anchor = {_row(cable.anchor)}"]
            lines.append(f"attachment = {_row(cable.attachment)}")
            lines += [f"{key} = {_number(value)}" for key, value in cable.own.items()]
        for effect in self.effects:
            lines += ["", "[[effect]]", f'id = "{effect.id}"']
            if effect.cable is not None:
                lines.append(f"cable = {effect.cable}")
            for key, value in effect.values.items():
                lines.append(f"{key} = {_value(value)}")
        return "\n".join(lines) + "\n"


WINCH = {
    "drum_radius": 0.5,  # m
    "gear_ratio": 1.0,
    "rotor_inertia": 0.0,  # kg m2, about the motor's axis
    "bandwidth": 20.0,  # rad/s
    "damping": 0.7,
    "force_limit": 5e4,  # N
}

SCALARS = (
    "platform_mass",
    "platform_inertia",
    "anchor_radius",
    "attachment_radius",
    "cable_density",
    "youngs_modulus",
    "cable_area",
    "cable_damping",
)


def _number(value: float) -> str:
    text = repr(float(value))
    return text if any(c in text for c in ".en") else text + ".0"


def _value(value: float | str) -> str:
    return f'"{value}"' if isinstance(value, str) else _number(value)


def _row(values) -> str:
    return f"[{', '.join(_number(v) for v in values)}]"


class Inputs:
    """The inputs over time: the winch forces (N), two forces (N) and a torque (N m).

    Knots `times[k]` start segments on which the inputs are `values[k] + slopes[k] (t - times[k])`;
    without slopes this is a zero-order hold. Before the first knot the first value holds.
    """

    def __init__(self, times, values, slopes=None):
        self.times = [float(t) for t in times]
        self.values = np.asarray(values, dtype=float).reshape(len(self.times), -1)
        self.slopes = np.zeros_like(self.values) if slopes is None else np.asarray(slopes, float)

    @classmethod
    def constant(cls, winch_force, wrench=(0.0, 0.0, 0.0)) -> Inputs:
        """The same inputs for ever."""
        return cls([0.0], [[*winch_force, *wrench]])

    def segment(self, time: float) -> int:
        """The segment that begins at or contains `time`."""
        return max(bisect.bisect_right(self.times, time) - 1, 0)

    def on_segment(self, index: int, time: float) -> np.ndarray:
        """Inputs at `time` by the law of one segment (so that a right end has its left limit)."""
        return self.values[index] + self.slopes[index] * max(time - self.times[index], 0.0)

    def at(self, time: float) -> np.ndarray:
        """Inputs just after `time`."""
        return self.on_segment(self.segment(time), time)
