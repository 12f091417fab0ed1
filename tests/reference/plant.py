"""The equations of motion of the platform and its cables.

A planar vector is a complex number. With z = G + E - A the cable's vector, S = z/|z|, and conj(S)
turning into the cable's frame (real part along S, imaginary part along N = iS):

    z'  conj(S) = L' + i L α'
    z'' conj(S) = (L'' - L α'^2) + i (L α'' + 2 L' α')

so all lengths, angles and their derivatives come from z, z' and z''. The platform's residual is
linear in its accelerations (for a given set of taut cables); its matrix is found by evaluating the
residual at unit accelerations.
"""

from __future__ import annotations

import itertools
from dataclasses import dataclass, replace

import numpy as np
from scipy.optimize import brentq

from .parameters import (
    AIR_DENSITY,
    LUMPED_MASS,
    MASSLESS_SPRING,
    RIGID,
    Parameters,
)
from .winch import WinchChain


@dataclass
class Motion:
    """The cables seen from a pose and twist (arrays of four; complex where planar vectors)."""

    arm: np.ndarray  # E, m
    S: np.ndarray
    L: np.ndarray
    L_rate: np.ndarray
    span: np.ndarray  # the straight part of L, m
    span_rate: np.ndarray
    angle: np.ndarray
    angle_rate: np.ndarray


def with_elasticity(p: Parameters) -> Parameters:
    """The model that `cable_elasticity` makes of another."""
    for effect in p.find("cable_elasticity"):
        p = replace(
            p,
            cable_model=LUMPED_MASS,
            youngs_modulus=effect.values["axial_stiffness"] / p.cable_area,
            cable_damping=effect.values["damping"],
        )
    return p


class Plant:
    """States, in this order: x y φ, vx vy ω, l(n) unless rigid, l'(n) if the cables have axial
    inertia and are `lumped_mass`, the creep strains, the states of the winch lags, bow and velocity
    of the swinging cables, the deflections of friction that gives before it slides, then what
    share of its level the hysteresis of a cable holds."""

    def __init__(self, parameters: Parameters):
        p = self.parameters = with_elasticity(parameters)
        self.winches = WinchChain(p)
        self.cables = n = p.cables
        if p.cable:
            self.anchors = np.array([complex(*c.anchor) for c in p.cable])
            self.arms = np.array([complex(*c.attachment) for c in p.cable])
        else:
            self.anchors = p.anchor_radius * np.exp(1j * np.array(p.anchor_angle))
            self.arms = p.attachment_radius * np.exp(1j * np.array(p.attachment_angle))
        self.pulleys = np.zeros(n)  # radii, m; > 0 where cables run clockwise round them
        self.mass = p.platform_mass
        self.inertia = p.platform_inertia
        self.com = complex(*p.centre_of_mass)  # centre of mass in the body frame
        self.EA = p.each("youngs_modulus", p.youngs_modulus) * p.each("area", p.cable_area)
        self.bl = p.each("damping", p.cable_damping)
        self.rho = p.each("density", p.cable_density)
        self.stiffening = np.zeros(n)
        self.compliance = np.zeros(n)  # m/N of the anchors
        self.gearing = p.of_winches("gear_ratio") / p.of_winches("drum_radius")  # 1/m
        self.drum_mass = p.of_winches("rotor_inertia") * self.gearing**2
        self.drag = np.zeros(n)
        heavy = p.cable_inertia != "none"
        self.straight = heavy * self.rho / 3.0  # kg/m that the end carries across
        self.end = np.zeros(n)  # kg/m that it carries along
        self.swings = []
        for effect in p.effects:
            self._apply(effect)
        self.lengths, self.length_rates = slice(6, 6 + n), slice(6 + n, 6 + 2 * n)
        self.axial_mass = p.cable_inertia != "none" or bool(self.drum_mass.any())
        # Without axial inertia a lumped-mass cable is a massless spring.
        self.has_length = p.cable_model != RIGID
        self.has_length_rate = p.cable_model == LUMPED_MASS and self.axial_mass
        self.creeps = [
            (i, e.values["axial_stiffness"], e.values["time_constant"])
            for e in p.find("cable_creep")
            for i in range(n)
            if e.acts_on(i) and self.has_length
        ]
        self.first_creep = 6 + n * (self.has_length + self.has_length_rate)
        self.first_lag = self.first_creep + len(self.creeps)
        self.first_swing = self.first_lag + len(self.winches.bands) + len(self.winches.lags)
        self.first_bristle = self.first_swing + 2 * len(self.swings)
        self.ropes = [
            (i, e.values["force"], e.values["yield_strain"])
            for e in p.find("cable_hysteresis")
            for i in range(n)
            if e.acts_on(i) and self.has_length
        ]
        self.first_rope = self.first_bristle + len(self.winches.bristles)
        self.size = self.first_rope + len(self.ropes)

    def at(self, t: float) -> Plant:
        """The plant with the effects that are there at this time; they keep no states."""
        p = self.parameters
        if not any(effect.switches for effect in p.effects):
            return self
        now = Plant(replace(p, effects=tuple(e for e in p.effects if e.in_force(t))))
        if now.size != self.size:
            raise ValueError("an effect with states begins or ends")
        return now

    def _apply(self, effect):
        """Effects that are a change of a parameter."""
        v = effect.values
        cables = [i for i in range(self.cables) if effect.acts_on(i)]
        match effect.id:
            case "platform_mass":
                self.mass += v["mass"]
            case "platform_inertia":
                self.inertia += v["inertia"]
            case "platform_com_offset":
                self.com += complex(v["x"], v["y"])
            case "anchor_offset":
                self.anchors[cables] += complex(v["x"], v["y"])
            case "pulley_radius":
                self.pulleys[cables] += v["radius"]
            case "attachment_offset":
                self.arms[cables] += complex(v["x"], v["y"])
            case "cable_stiffness":
                self.EA[cables] *= 1.0 + v["factor"]
            case "cable_damping":
                self.bl[cables] *= 1.0 + v["factor"]
            case "cable_stiffening":
                self.stiffening[cables] += v["coefficient"]
            case "anchor_compliance":
                self.compliance[cables] += 1.0 / v["stiffness"]
            case "winch_drum_inertia":
                self.drum_mass[cables] += v["mass"]
            case "cable_drag":
                self.drag[cables] += AIR_DENSITY / 8.0 * v["drag_area_per_length"]
            case "cable_axial_mass":
                self.end[cables] += v["linear_density"] / 2.0
            case "cable_transverse_mode":
                self.straight[cables] *= 1.0 - 6.0 / np.pi**2
                self.swings += [(i, v) for i in cables]

    # ---- kinematics

    def motion(self, pose, twist) -> Motion:
        """Cable vectors and their rates at a pose (x, y, φ) and twist (vx, vy, ω)."""
        arm = self.arms * np.exp(1j * pose[2])
        z = complex(pose[0], pose[1]) + arm - self.anchors
        # z = (f + i r) S: the straight part and, square to it, the radius to where it begins.
        span = np.sqrt(np.abs(z) ** 2 - self.pulleys**2)
        S = z / (span + 1j * self.pulleys)
        home = self.arms - self.anchors
        home = home / (np.sqrt(np.abs(home) ** 2 - self.pulleys**2) + 1j * self.pulleys)
        L = span - self.pulleys * np.angle(S / home)
        z_rate = (complex(twist[0], twist[1]) + 1j * twist[2] * arm) * S.conj()
        turn = z_rate.imag / span
        span_rate = z_rate.real + self.pulleys * turn
        return Motion(arm, S, L, z_rate.real, span, span_rate, np.angle(S), turn)

    def _cable_accelerations(self, m: Motion, twist, acceleration):
        z_acc = (
            complex(acceleration[0], acceleration[1])
            + (1j * acceleration[2] - twist[2] ** 2) * m.arm
        ) * m.S.conj()
        return z_acc.real + m.span * m.angle_rate**2, (
            z_acc.imag - (m.L_rate + m.span_rate) * m.angle_rate
        ) / m.span

    # ---- cables

    def _inertia_terms(self, length, rate, angle_rate):
        """Axial inertia force `mass * length'' + rest` of a moving cable."""
        rho = self.rho
        match self.parameters.cable_inertia:
            case "paper":
                mass = rho / 2.0 * length
                rest = rho / 2.0 * (rate**2 - (length * angle_rate) ** 2)
            case "reeled":
                mass = rho * length
                rest = -rho / 2.0 * (length * angle_rate) ** 2
            case "none":
                mass = 0.0 * length
                rest = 0.0 * length
        return mass + self.drum_mass, rest

    def _warmth(self, t) -> float:
        """Factor on the unstretched lengths in the springs. The dashpots see the reeled-out
        lengths: their material does not creak for being warmed slowly."""
        factor = 1.0
        for effect in self.parameters.find("cable_thermal_expansion"):
            v = effect.values
            angle = 2.0 * np.pi / v["period"] * t + v.get("phase", 0.0)
            factor += v["strain_amplitude"] * np.sin(angle)
        return factor

    def _swinging(self, y, m, tension):
        """Forces across the cables (N) and rates of bow and velocity, by Lagrange's equations for
        the bow from the chord and the end's motion, with the mode's momentum as a state."""
        across = np.zeros(self.cables)
        rates = []
        for (i, v), (bow, velocity) in zip(
            self.swings, y[self.first_swing : self.first_bristle].reshape(-1, 2), strict=True
        ):
            L, end, T = m.span[i], m.span[i] * m.angle_rate[i], max(tension[i], 0.0)
            bow_rate = velocity - 2.0 / np.pi * end
            x, weight = np.polynomial.legendre.leggauss(6)
            x, weight = (x + 1.0) / 2.0, weight / 2.0
            speed = end * x + bow_rate * np.sin(np.pi * x)
            air = -AIR_DENSITY / 2.0 * v.get("drag_area_per_length", 0.0) * np.abs(speed) * speed
            on_mode = L * np.sum(weight * air * np.sin(np.pi * x))
            on_chord = L * np.sum(weight * air * x)
            mass = v["linear_density"] * L / 2.0
            stiffness = T * np.pi**2 / (2.0 * L)
            damping = 2.0 * v.get("damping_ratio", 0.0) * np.sqrt(stiffness * mass)
            restoring = stiffness * bow + damping * bow_rate
            rates += [bow_rate, (on_mode - restoring) / mass]
            across[i] += on_chord + 2.0 / np.pi * (restoring - on_mode)
        return across, rates

    def _bowed(self, y, L):
        """Lengths of the cables along their bows."""
        longer = L.copy()
        bows = y[self.first_swing : self.first_bristle : 2]
        for (i, _), bow in zip(self.swings, bows, strict=True):
            longer[i] += (np.pi * bow) ** 2 / (4.0 * L[i])
        return longer

    def spring_force(self, L, unstretched, creep=0.0) -> np.ndarray:
        """Elastic force for a geometric and an unstretched length; negative when slack."""
        strain = (L - unstretched) / unstretched - creep
        force = self.EA * strain * (1.0 + self.stiffening * strain**2)
        force /= 1.0 + self.EA * self.compliance / L
        for effect in self.parameters.find("cable_sag"):
            for i in range(self.cables):
                if effect.acts_on(i):
                    force[i] = self._sagging_force(effect.values, self.EA[i], L[i], strain[i])
        for effect in self.parameters.find("cable_catenary"):
            for i in range(self.cables):
                if effect.acts_on(i):
                    weight, free = effect.values["weight"], unstretched[i]
                    force[i] = self._hanging_force(weight, self.EA[i], free, strain[i])
        return force

    @staticmethod
    def _hanging_force(weight, EA, unstretched, strain) -> float:
        """The horizontal force at which a cable between two points of one height has this strain
        of its span: the sum of its pieces, each along the force in it and stretched by it."""
        x, share = np.polynomial.legendre.leggauss(80)
        s = unstretched * x / 2.0

        def excess(horizontal):
            force = np.hypot(horizontal, weight * s)
            span = unstretched / 2.0 * np.sum(share * horizontal / force * (1.0 + force / EA))
            return span - unstretched * (1.0 + strain)

        return brentq(excess, 1e-3, 1e8, xtol=1e-12, rtol=1e-14)

    @staticmethod
    def _sagging_force(v, EA, L, strain) -> float:
        """The tension at which a heavy cable has this chord strain; the strain grows with it."""
        sag = (v["weight"] * L) ** 2 / 24.0

        def excess(tension):
            return tension / EA - sag * (tension**-2 - v["reference_tension"] ** -2) - strain

        return brentq(excess, 1e-3, 1e8, xtol=1e-12, rtol=1e-14)

    def unstretched_for(self, L, tension) -> np.ndarray:
        """Unstretched lengths at which the springs carry `tension` (no sag, no creep)."""
        tension = np.asarray(tension, dtype=float)
        strain = tension / self.EA
        for _ in range(50):
            both = self.EA / (1.0 + self.EA * self.compliance / L)
            force = both * strain * (1.0 + self.stiffening * strain**2)
            slope = both * (1.0 + 3.0 * self.stiffening * strain**2)
            strain = strain - (force - tension) / slope
        return L / (1.0 + strain)

    # ---- platform

    @staticmethod
    def _term(expression, t, pose, twist) -> float:
        """An `expression` over pose, twist and time."""
        names = dict(zip(("x", "y", "phi", "vx", "vy", "omega"), (*pose, *twist), strict=True))
        functions = {name: getattr(np, name) for name in ("sin", "cos", "tanh", "exp", "abs")}
        text = expression.replace("^", "**")
        return float(eval(text, {"__builtins__": {}}, functions | names | {"time": t}))

    def _external(self, t, pose, twist, wrench) -> tuple[complex, float]:
        """Force and torque at the platform's centre G that do not come through the cables."""
        force = complex(wrench[0], wrench[1])
        torque = float(wrench[2])
        position = complex(pose[0], pose[1])
        velocity = complex(twist[0], twist[1])
        for effect in self.parameters.effects:
            v = effect.values
            match effect.id:
                case "platform_linear_drag":
                    force -= v["coefficient"] * velocity
                case "platform_quadratic_drag":
                    wind = complex(v.get("wind_x", 0.0), v.get("wind_y", 0.0))
                    force -= v["coefficient"] * abs(velocity - wind) * (velocity - wind)
                case "platform_rotational_damping":
                    torque -= v["coefficient"] * twist[2]
                case "steady_wind":
                    force += complex(v["force_x"], v["force_y"])
                    torque += v["torque"]
                case "periodic_gust":
                    size = v["amplitude"] * np.sin(v["frequency"] * t + v["phase"])
                    force += size * np.exp(1j * v["direction"])
                case "umbilical":
                    ground = complex(v["x"], v["y"])
                    force -= v["stiffness"] * (position - ground) + v["damping"] * velocity
                case "expression":
                    term = self._term(v["expression"], t, pose, twist)
                    match v["target"]:
                        case "platform.force_x":
                            force += term
                        case "platform.force_y":
                            force += 1j * term
                        case "platform.torque":
                            torque += term
        return force, torque

    def _platform_residual(self, t, pose, twist, acceleration, m, wrench, tension, across):
        """M a - forces and I φ'' - torques about G, for given tensions and swinging cables."""
        L_acc, angle_acc = self._cable_accelerations(m, twist, acceleration)
        transverse = across - self.straight * (
            m.span**2 * angle_acc + 3.0 * m.span * m.span_rate * m.angle_rate
        )
        transverse -= self.drag * m.span**3 * np.abs(m.angle_rate) * m.angle_rate
        for effect in self.parameters.find("cable_wind"):
            transverse += self._wind(effect.values, m)
        pull = (-tension - self.end * m.L * L_acc + 1j * transverse) * m.S
        force, torque = self._external(t, pose, twist, wrench)
        offset = self.com * np.exp(1j * pose[2])
        a = complex(acceleration[0], acceleration[1])
        a_com = a + (1j * acceleration[2] - twist[2] ** 2) * offset
        momentum_rate = self.mass * a_com
        momentum_rate -= self.mass * complex(*self.parameters.gravity)
        balance = momentum_rate - force - pull.sum()
        moment = (
            self.inertia * acceleration[2]
            + (offset.conjugate() * momentum_rate).imag
            - torque
            - (m.arm.conj() * pull).imag.sum()
        )
        return np.array([balance.real, balance.imag, moment])

    def _wind(self, v, m) -> np.ndarray:
        """Force across each cable at its platform end by the wind on all of it."""
        nodes, weights = np.polynomial.legendre.leggauss(6)
        share = 0.5 * (nodes + 1.0)  # of the way from the anchor
        force = np.zeros(self.cables)
        for i in range(self.cables):
            s = share * m.span[i]
            height = self.anchors[i].imag + s * m.S[i].imag - v.get("ground", 0.0)
            profile = np.ones(6)
            if v.get("exponent", 0.0):
                above = np.maximum(height, 0.0) / v.get("reference_height", 10.0)
                profile = above ** v["exponent"]
            wind = complex(v["wind_x"], v["wind_y"])
            across = (wind * (1j * m.S[i]).conjugate()).real * profile - s * m.angle_rate[i]
            load = 0.5 * AIR_DENSITY * v["drag_area_per_length"] * np.abs(across) * across
            force[i] = 0.5 * m.span[i] * np.sum(weights * share * load)
        return force

    def _solve_accelerations(self, residual):
        """The root of a residual that is affine in three accelerations."""
        at_rest = residual(np.zeros(3))
        matrix = np.column_stack([residual(unit) - at_rest for unit in np.eye(3)])
        return np.linalg.solve(matrix, -at_rest)

    def _dynamics_with_force_driven_cables(self, t, pose, twist, m, pull, wrench, swinging):
        """Accelerations and tensions where the tension follows from the winch force and the
        platform's motion: T = max(0, u + inertia). The right set of taut cables is the one that
        agrees with itself; the map is monotone, so there is exactly one."""
        mass, rest = self._inertia_terms(m.L, m.L_rate, m.angle_rate)

        def axial(acceleration):
            L_acc, _ = self._cable_accelerations(m, twist, acceleration)
            return pull + mass * L_acc + rest

        for taut in itertools.product((True, False), repeat=self.cables):
            taut = np.array(taut)
            # A swinging cable takes the winch's pull for its tension, which has no jumps.
            across, _ = swinging(np.where(taut, pull, 0.0))

            def residual(acceleration, taut=taut, across=across):
                tension = np.where(taut, axial(acceleration), 0.0)
                return self._platform_residual(
                    t, pose, twist, acceleration, m, wrench, tension, across
                )

            acceleration = self._solve_accelerations(residual)
            force = axial(acceleration)
            if np.array_equal(force > 0.0, taut):
                return acceleration, np.where(taut, force, 0.0)
        # Only a cable exactly at zero can bring us here; both choices give the same motion.
        return acceleration, np.maximum(force, 0.0)

    def _creep(self, y):
        creep = np.zeros(self.cables)
        for k, (i, _, _) in enumerate(self.creeps):
            creep[i] += y[self.first_creep + k]
        return creep

    def _held(self, y):
        """Tensions that hysteresis holds beside the springs."""
        held = np.zeros(self.cables)
        for k, (i, force, _) in enumerate(self.ropes):
            held[i] += force * y[self.first_rope + k]
        return held

    def _rope_rates(self, y, tension, m, length, rate):
        """Bouc and Wen's law of the strain; a slack cable is not strained."""
        rates = []
        for k, (i, _, yield_strain) in enumerate(self.ropes):
            share = y[self.first_rope + k]
            strain_rate = m.L_rate[i] / length[i] - m.L[i] * rate[i] / length[i] ** 2
            strain_rate *= tension[i] > 0.0
            rates.append((strain_rate - abs(strain_rate) * share) / yield_strain)
        return rates

    def _carried(self, t, y, m):
        """Tensions of cables with a mass at the winch end."""
        length, rate = y[self.lengths], y[self.length_rates]
        damping = self.bl / length * (m.L_rate - rate)
        spring = self.spring_force(self._bowed(y, m.L), length * self._warmth(t), self._creep(y))
        spring = spring + self._held(y)
        # Where there is no strain there is nothing for the damper to pull on.
        return np.where(spring > 0.0, np.maximum(spring + damping, 0.0), 0.0)

    def _winch_force(self, t, y, m, command):
        """The forces that the drives make of the winches' commands (after their delays).

        A servo pulls so that the end of the cable that it holds follows its command as a filter of
        first order (speed) or second order (length) would.
        """
        p = self.parameters
        if p.command in ("force", "torque"):
            return command * (self.gearing if p.command == "torque" else 1.0)
        length, rate = y[self.lengths], y[self.length_rates]
        bandwidth = p.of_winches("bandwidth")
        if p.command == "speed":
            wanted = bandwidth * (command - rate)
        else:
            wanted = bandwidth * (
                bandwidth * (command - length) - 2.0 * p.of_winches("damping") * rate
            )
        mass, rest = self._inertia_terms(length, rate, m.angle_rate)
        limit = p.of_winches("force_limit")
        return np.clip(self._carried(t, y, m) - rest - mass * wanted, -limit, limit)

    def evaluate(self, t, y, command, wrench):
        """Everything at one instant: accelerations, rates of the other states, tensions.

        `command` are what the winches are told, after their delays.
        """
        pose, twist = y[0:3], y[3:6]
        m = self.motion(pose, twist)
        command = self._winch_force(t, y, m, command)
        lagged, lag_rates = self.winches.lag(
            self.winches.saturate(command), y[self.first_lag : self.first_swing]
        )
        deflections = y[self.first_bristle : self.first_rope]
        creep = self._creep(y)
        warmth = self._warmth(t)
        bowed = self._bowed(y, m.L)
        if self.has_length_rate:
            length, rate = y[self.lengths], y[self.length_rates]
            pull = self.winches.deliver(lagged, length, rate, deflections)
            tension = self._carried(t, y, m)
            across, swing_rates = self._swinging(y, m, tension)
            acceleration = self._solve_accelerations(
                lambda a: self._platform_residual(t, pose, twist, a, m, wrench, tension, across)
            )
            mass, rest = self._inertia_terms(length, rate, m.angle_rate)
            length_acc = (tension - pull - rest) / mass
            cable_rates = np.concatenate([rate, length_acc])
        else:
            # The losses see the rate of the geometric length, so that the platform moves as with
            # rigid cables whatever the springs do.
            paid_out = y[self.lengths] if self.has_length else m.L
            pull = self.winches.deliver(lagged, paid_out, m.L_rate, deflections)
            acceleration, tension = self._dynamics_with_force_driven_cables(
                t, pose, twist, m, pull, wrench, lambda carried: self._swinging(y, m, carried)
            )
            _, swing_rates = self._swinging(y, m, np.where(tension > 0.0, pull, 0.0))
            length, rate = m.L, m.L_rate
            cable_rates = np.empty(0)
            if self.has_length:
                length = y[self.lengths]
                imbalance = self.spring_force(bowed, length * warmth, creep) - tension
                imbalance = imbalance + self._held(y)
                rate = m.L_rate + imbalance * length / self.bl
                cable_rates = rate
        creep_rates = [
            (tension[i] / stiffness - y[self.first_creep + k]) / time_constant
            for k, (i, stiffness, time_constant) in enumerate(self.creeps)
        ]
        # As the losses, the deflections follow the rate of the paid-out end.
        paid_out = y[self.length_rates] if self.has_length_rate else m.L_rate
        bristle_rates = self.winches.bristle_rates(paid_out, deflections)
        rope_rates = self._rope_rates(y, tension, m, length, rate)
        own_rates = [creep_rates, lag_rates, swing_rates, bristle_rates, rope_rates]
        y_rate = np.concatenate([twist, acceleration, cable_rates, *own_rates])
        return y_rate, m, tension, length, rate

    # ---- starting and reading

    def initial_state(
        self, pose, twist=(0, 0, 0), command=None, unstretched=None, unstretched_rate=None
    ):
        """A state; without `unstretched` every spring carries its winch force, at rest."""
        m = self.motion(pose, twist)
        y = np.zeros(self.size)
        y[0:3], y[3:6] = pose, twist
        force = self.start_force(command)
        limited = None if force is None else self.winches.saturate(force)
        if self.has_length:
            if unstretched is None:
                lag = self.winches.lag_at_rest(limited)
                lagged, _ = self.winches.lag(limited, lag)
                pull = self.winches.deliver(
                    lagged, m.L, np.zeros(self.cables), np.zeros(len(self.winches.bristles))
                )
                unstretched = self.unstretched_for(m.L, np.maximum(pull, 0.0))
            y[self.lengths] = unstretched
        if self.has_length_rate and unstretched_rate is not None:
            y[self.length_rates] = unstretched_rate
        if self.winches.bands or self.winches.lags:
            y[self.first_lag : self.first_swing] = self.winches.lag_at_rest(limited)
        for k, (i, _) in enumerate(self.swings):
            # Straight, and moving as the chord does.
            y[self.first_swing + 2 * k + 1] = 2.0 / np.pi * m.span[i] * m.angle_rate[i]
        return y

    def start_force(self, command):
        """Winch forces of a start under these commands; servos hold 8 kN then."""
        if command is None or self.parameters.command == "force":
            return None if command is None else np.asarray(command, float)
        if self.parameters.command == "torque":
            return np.asarray(command, float) * self.gearing
        return np.full(self.cables, 8000.0)

    def outputs(self, t, y, command, wrench) -> dict[str, float]:
        """The values that the FMU shows under the same names (sensor delays not included)."""
        y_rate, m, tension, length, rate = self.evaluate(t, y, command, wrench)
        drum = self.parameters.of_winches("drum_radius")
        out = dict(zip(("x", "y", "phi", "vx", "vy", "omega"), y[:6], strict=True))
        for i in range(self.cables):
            n = f"[{i + 1}]"
            out["cable_length" + n] = m.L[i]
            out["cable_angle" + n] = m.angle[i]
            out["unstretched_length" + n] = length[i]
            out["unstretched_length_rate" + n] = rate[i]
            out["tension" + n] = tension[i]
            out["strain" + n] = (m.L[i] - length[i]) / length[i]
            out["winch_angle" + n] = length[i] / drum[i]
            out["winch_rate" + n] = rate[i] / drum[i]
        out |= dict(zip(("ax", "ay", "alpha"), y_rate[3:6], strict=True))
        for effect in self.parameters.effects:
            self._sensor(effect, y, out)
        return {name: float(value) for name, value in out.items()}

    def _sensor(self, effect, y, out):
        v = effect.values
        cables = [i for i in range(self.cables) if effect.acts_on(i)]
        channel = v.get("channel", "unstretched_length")
        match effect.id:
            case "winch_drum_eccentricity":
                drum = self.parameters.of_winches("drum_radius")
                e, r, phase = v["eccentricity"], v["drum_radius"], v["phase"]
                for i in cables:
                    n = f"[{i + 1}]"
                    length = out["unstretched_length" + n]

                    def excess(angle, length=length):
                        wave = np.cos(angle + phase) - np.cos(phase)
                        return r * angle - e * wave - length

                    turned = brentq(excess, (length - 3 * e) / r, (length + 3 * e) / r, xtol=1e-14)
                    rate = out["unstretched_length_rate" + n] / (r + e * np.sin(turned + phase))
                    out["unstretched_length" + n] = r * turned
                    out["unstretched_length_rate" + n] = r * rate
                    out["winch_angle" + n] = r * turned / drum[i]
                    out["winch_rate" + n] = r * rate / drum[i]
            case "winch_drum_layers":
                # What is wound up shrinks with the length; the angle is the sum of dl/radius.
                full, thick, n = v["drum_radius"], v["cable_diameter"], v["turns"]
                drum = self.parameters.of_winches("drum_radius")
                for i in cables:
                    at = f"[{i + 1}]"
                    radius = np.sqrt(full**2 - thick * out["unstretched_length" + at] / (np.pi * n))
                    turned = 2.0 * np.pi * n * (full - radius) / thick
                    rate = out["unstretched_length_rate" + at] / radius
                    out["unstretched_length" + at] = full * turned
                    out["unstretched_length_rate" + at] = full * rate
                    out["winch_angle" + at] = full * turned / drum[i]
                    out["winch_rate" + at] = full * rate / drum[i]
            case "length_sensor_bias":
                for i in cables:
                    out[f"{channel}[{i + 1}]"] += v["bias"]
            case "length_sensor_scale":
                # A wrong drum radius: the rate is read off the same drum.
                for i in cables:
                    out[f"{channel}[{i + 1}]"] *= 1.0 + v["factor"]
                    if channel == "unstretched_length":
                        out[f"{channel}_rate[{i + 1}]"] *= 1.0 + v["factor"]
            case "tension_sensor_gain":
                for i in cables:
                    out[f"tension[{i + 1}]"] *= 1.0 + v["factor"]
            case "tension_sensor_bias":
                for i in cables:
                    out[f"tension[{i + 1}]"] += v["bias"]
            case "pose_sensor_frame":
                # Before a bias, wherever it stands in the list.
                mark = complex(v.get("x", 0.0), v.get("y", 0.0)) * np.exp(1j * y[2])
                turn = np.exp(-1j * v["angle"])
                seen = (complex(y[0], y[1]) + mark) * turn - complex(y[0], y[1])
                out["x"] += seen.real
                out["y"] += seen.imag
                out["phi"] -= v["angle"]
            case "pose_sensor_scale":
                out["x"] *= 1.0 + v["factor"]
                out["y"] *= 1.0 + v["factor"]
            case "pose_sensor_bias":
                for name in ("x", "y", "phi"):
                    out[name] += v.get(name, 0.0)


__all__ = ["LUMPED_MASS", "MASSLESS_SPRING", "RIGID", "Motion", "Plant"]
