"""What happens between the commanded winch force and the pull that the cable feels.

The order is: command, delay, saturation, lag, gain, bias, power limit, losses.
"""

from __future__ import annotations

import math

import numpy as np

from .parameters import Parameters

CAPSTAN_SPEED = 0.01  # m/s, where the capstan loss changes its sign


def in_direction(values: dict, rate: float) -> float:
    """How much of the level there is in the direction of the rate."""
    return 1.0 + values.get("asymmetry", 0.0) * math.copysign(1.0, rate)


def sliding(values: dict, rate: float) -> float:
    """Coulomb friction at a constant speed."""
    speed = rate / values["transition_speed"]
    tail, algebraic = values.get("tail", 0.0), values.get("algebraic", 0.0)
    slow = 2.0 / math.pi * math.atan(math.pi * speed / 2.0)
    root = speed / math.hypot(1.0, speed)
    sharp = (1.0 - tail - algebraic) * math.tanh(speed)
    sign = sharp + tail * slow + algebraic * root
    return values["force"] * sign * (1.0 + values.get("asymmetry", 0.0) * sign)


def dry_level(values: dict, rate: float) -> float:
    """Stribeck friction at full sliding, without its viscous part."""
    more = values["static"] - values["coulomb"]
    return values["coulomb"] + more * math.exp(-((rate / values["stribeck_speed"]) ** 2))


def holding_level(values: dict, rate: float) -> float:
    """What a bristle holds at most at this rate: Canudas de Wit's g."""
    dry = values["force"] if "force" in values else dry_level(values, rate)
    return dry * in_direction(values, rate)


def bristle_damping(values: dict, rate: float) -> float:
    """Damping of a bristle: it fades with speed, and stays below what would give energy away where
    the level changes with speed, so that a bristle may hold up to `ratio` times the level."""
    damping = values.get("presliding_damping", 0.0)
    if values.get("damping_speed", 0.0):
        damping *= math.exp(-((rate / values["damping_speed"]) ** 2))
    levels = [values[name] for name in ("force", "coulomb", "static") if name in values]
    ratio = min(max(levels) / min(levels), 2.0)
    if ratio > 1.0 and damping > 0.0 and rate != 0.0:
        weaker = min(levels) * (1.0 - abs(values.get("asymmetry", 0.0)))
        limit = weaker * ratio**2 / (ratio - 1.0)
        damping = 1.0 / (1.0 / damping + abs(rate) / limit)
    return damping


class WinchChain:
    """The effects that sit on the winches."""

    def __init__(self, parameters: Parameters):
        self.parameters = parameters
        self.cables = parameters.cables
        self.delays = np.zeros(self.cables)
        for i, effect in self._each("winch_delay"):
            self.delays[i] += effect.values["delay"]
        # One lag is one state; several on one winch follow each other.
        self.lags = [
            (i, e.values["time_constant"], e.values.get("rate_limit", 0.0) or math.inf)
            for i, e in self._each("winch_lag")
        ]
        # A dead band is a state as well, before the lags.
        self.bands = [
            (i, e.values["band"], e.values["time_constant"])
            for i, e in self._each("winch_dead_band")
        ]
        # Friction that gives before it slides keeps a deflection on each winch.
        self.bristles = [
            (i, e.values)
            for law in ("winch_coulomb_friction", "winch_stribeck_friction")
            for i, e in self._each(law)
            if e.values.get("presliding_stiffness", 0.0) > 0.0
        ]

    def _each(self, effect_id: str):
        for effect in self.parameters.find(effect_id):
            for i in range(self.cables):
                if effect.acts_on(i):
                    yield i, effect

    def saturate(self, delayed: np.ndarray) -> np.ndarray:
        """The delayed command within the bounds of the winches."""
        limited = np.array(delayed, dtype=float)
        for i, effect in self._each("winch_saturation"):
            limited[i] = min(max(limited[i], effect.values["lower"]), effect.values["upper"])
        return limited

    def lag(self, limited: np.ndarray, states: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """The force behind dead bands and lags, and the rates of their states."""
        force = np.array(limited, dtype=float)
        rates = np.zeros(len(self.bands) + len(self.lags))
        for k, (i, band, time_constant) in enumerate(self.bands):
            error = force[i] - states[k]
            rates[k] = (error - min(max(error, -band), band)) / time_constant
            force[i] = states[k]
        for k, (i, time_constant, limit) in enumerate(self.lags, start=len(self.bands)):
            rates[k] = min(max((force[i] - states[k]) / time_constant, -limit), limit)
            force[i] = states[k]
        return force, rates

    def lag_at_rest(self, limited: np.ndarray) -> np.ndarray:
        """States of dead bands and lags that have settled on the given force."""
        return np.array([limited[i] for i, *_ in self.bands + self.lags])

    def bristle_rates(self, reeling_rate: np.ndarray, deflections: np.ndarray) -> np.ndarray:
        """Rates of the deflections (LuGre): v - s0 |v|/g z, where g is the sliding friction."""
        rates = np.zeros(len(self.bristles))
        for k, (i, v) in enumerate(self.bristles):
            rate = reeling_rate[i]
            held = v["presliding_stiffness"] * deflections[k]
            rates[k] = rate - abs(rate) * held / holding_level(v, rate)
        return rates

    def deliver(
        self,
        lagged: np.ndarray,
        length: np.ndarray,
        reeling_rate: np.ndarray,
        deflections: np.ndarray,
    ) -> np.ndarray:
        """The pull felt by the cables of these paid-out lengths; `reeling_rate` is positive when
        paying out."""
        force = np.array(lagged, dtype=float)
        for i, effect in self._each("winch_force_gain"):
            force[i] *= 1.0 + effect.values["factor"]
        for i, effect in self._each("winch_force_bias"):
            force[i] += effect.values["bias"]
        for i, effect in self._each("winch_power_limit"):
            power = -force[i] * reeling_rate[i]
            force[i] *= min(1.0, effect.values["power"] / power) if power > 0.0 else 1.0
        for i, effect in self._each("winch_torque_ripple"):
            v = effect.values
            angle = 2.0 * math.pi * length[i] / v["period"] + v["phase"]
            force[i] += v["amplitude"] * math.sin(angle)
        pull = force.copy()
        for i, effect in self._each("winch_coulomb_friction"):
            if not effect.values.get("presliding_stiffness", 0.0):
                pull[i] += sliding(effect.values, reeling_rate[i])
        rates = self.bristle_rates(reeling_rate, deflections)
        for (i, v), z, z_rate in zip(self.bristles, deflections, rates, strict=True):
            pull[i] += v["presliding_stiffness"] * z + bristle_damping(v, reeling_rate[i]) * z_rate
        for i, effect in self._each("winch_viscous_friction"):
            pull[i] += effect.values["coefficient"] * reeling_rate[i]
        for i, effect in self._each("winch_stribeck_friction"):
            v, rate = effect.values, reeling_rate[i]
            pull[i] += v["viscous"] * rate
            if v.get("presliding_stiffness", 0.0):
                continue
            transition = v.get("transition_speed", 0.0) or v["stribeck_speed"] / 10.0
            sign = math.tanh(rate / transition)
            pull[i] += dry_level(v, rate) * sign * (1.0 + v.get("asymmetry", 0.0) * sign)
        for i, effect in self._each("pulley_capstan_loss"):
            v = effect.values
            pull[i] += v["loss"] * abs(force[i]) * math.tanh(reeling_rate[i] / CAPSTAN_SPEED)
        for i, effect in self._each("pulley_wrap_friction"):
            v = effect.values
            speed = math.tanh(reeling_rate[i] / v.get("transition_speed", CAPSTAN_SPEED))
            pull[i] += abs(force[i]) * (math.exp(v["friction"] * v["wrap_angle"] * speed) - 1.0)
        return pull
