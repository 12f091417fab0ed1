"""Robots of the suite: geometry, masses and cables, and what their controller is set to."""

from dataclasses import dataclass

import numpy as np

#: Most cables of a robot of the suite.
MOST_CABLES = 8


@dataclass(frozen=True)
class Robot:
    """A planar robot; points in m, forces in N, masses in kg, `damping` in N s (b l)."""

    anchors: tuple  # (x, y) of each cable's winch, fixed frame
    attachments: tuple  # (x, y) of each cable's end, from the platform's centre at phi = 0
    mass: float
    inertia: float  # kg m2, about the centre of mass
    density: float  # kg/m
    stiffness: float  # EA of each cable
    damping: float
    gravity: tuple = (0.0, 0.0)  # m/s2
    feed_mass: float = 0.0  # with the cables' share, as the controller believes
    feed_inertia: float = 0.0
    least: float = 0.0  # tensions that the controller asks for: least and most
    most: float = 0.0

    @property
    def cables(self):
        """Number of cables."""
        return len(self.anchors)

    @property
    def lever(self):
        """Mean distance of the attachments from the platform's centre (m)."""
        return float(np.mean(np.linalg.norm(self.attachments, axis=1)))

    @property
    def usual_length(self):
        """Mean length of the cables with the platform at the origin (m)."""
        ends = np.array(self.attachments) - np.array(self.anchors)
        return float(np.mean(np.linalg.norm(ends, axis=1)))

    @property
    def winch_mass(self):
        """Half a cable's mass, which swings at its winch (kg)."""
        return 0.5 * self.density * self.usual_length

    def toml(self):
        """The robot as a model file's keys."""
        lines = [
            f"platform_mass = {self.mass}",
            f"platform_inertia = {self.inertia}",
            f"gravity = [{self.gravity[0]}, {self.gravity[1]}]",
            "youngs_modulus = 1e9",
            f"cable_area = {self.stiffness / 1e9!r}",
            f"cable_density = {self.density}",
            f"cable_damping = {self.damping}",
        ]
        for (ax, ay), (bx, by) in zip(self.anchors, self.attachments, strict=True):
            lines += ["[[cable]]", f"anchor = [{ax}, {ay}]", f"attachment = [{bx}, {by}]"]
        return "\n".join(lines) + "\n"


def _on_circle(radius, degrees):
    angles = np.radians(degrees)
    return tuple(zip(radius * np.cos(angles), radius * np.sin(angles), strict=True))


#: The telescope's robot, which is the default model.
TELESCOPE = Robot(
    anchors=_on_circle(900.0, [-135.0, -45.0, 45.0, 135.0]),
    attachments=_on_circle(10.0, [-45.0, -135.0, 135.0, 45.0]),
    mass=2500.0,
    inertia=3.5e5,
    density=0.215,
    stiffness=38e9 * 4e-4,
    damping=20000.0,
    feed_mass=2820.0,
    feed_inertia=3.7e5,
    least=200.0,
    most=1.2e5,
)


def _far(degrees, radii):
    angles = np.radians(degrees)
    return tuple(
        (round(r * np.cos(a), 1), round(r * np.sin(a), 1))
        for r, a in zip(radii, angles, strict=True)
    )


#: Three cables hold a platform of 500 kg up over a field of 100 m; the weight keeps them taut.
FIELD = Robot(
    anchors=((-50.0, 20.0), (50.0, 38.5), (4.5, 40.0)),
    attachments=((1.0, -0.3), (-0.55, 0.7), (0.95, 1.3)),
    mass=500.0,
    inertia=600.0,
    density=0.4,
    stiffness=4e6,
    damping=2e4,
    gravity=(0.0, -9.81),
    feed_mass=515.0,
    feed_inertia=605.0,
    least=100.0,
    most=1e4,
)

#: Six cables on a bench of 4 m with a platform of 20 kg, upright.
BENCH = Robot(
    anchors=((-2.0, -1.5), (0.1, -1.6), (2.0, -1.5), (2.0, 1.5), (-0.2, 1.6), (-2.0, 1.5)),
    attachments=(
        (0.05, -0.19),
        (0.12, -0.16),
        (0.19, -0.06),
        (0.19, -0.06),
        (-0.2, 0.04),
        (0.07, 0.19),
    ),
    mass=20.0,
    inertia=1.6,
    density=0.1,
    stiffness=1e5,
    damping=40.0,
    gravity=(0.0, -9.81),
    feed_mass=20.4,
    feed_inertia=1.6,
    least=5.0,
    most=2000.0,
)

#: Eight cables on a large frame without symmetry.
EIGHT = Robot(
    anchors=_far(
        [-160, -120, -75, -30, 20, 65, 110, 155], [850, 900, 780, 880, 860, 900, 800, 870]
    ),
    attachments=_far([-70, -30, -165, -120, 110, 150, 20, 70], [10, 9, 10, 11, 10, 9, 10, 11]),
    mass=3000.0,
    inertia=4e5,
    density=0.215,
    stiffness=1.52e7,
    damping=20000.0,
    feed_mass=3500.0,
    feed_inertia=4.3e5,
    least=200.0,
    most=1.2e5,
)
