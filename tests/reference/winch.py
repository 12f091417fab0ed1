"""What happens between the commanded winch force and the pull that the cable feels.

The order is: command, delay, saturation, lag, gain, bias, losses.
"""

from __future__ import annotations

import math

import numpy as np

from .parameters import Parameters

CAPSTAN_SPEED = 0.01  # m/s, where the capstan loss changes its sign


def sliding(values: dict, rate: float) -> float:
    """Coulomb friction at a constant speed."""
    speed = rate / values["transition_speed"]
    tail, algebraic = values.get("tail", 0.0), values.get("algebraic", 0.0)
    slow = 2.0 / math.pi * math.atan(math.pi * speed / 2.0)
    root = speed / math.hypot(1.0, speed)
    sharp = (1.0 - tail - algebraic) * math.tanh(speed)
    return values["force"] * (sharp + tail * slow + algebraic * root)


class WinchChain:
    """The effects that sit on the winches."""

    def __init__(self, parameters: Parameters):
        self.parameters = parameters
        self.cables = parameters.cables
        self.delays = np.zeros(self.cables)
        for i, effect in self._each("winch_delay"):
            self.delays[i] += effect.values["delay"]
        # One lag is one state; several on one winch follow each other.
        self.lags = [(i, e.values["time_constant"]) for i, e in self._each("winch_lag")]
        # Coulomb friction that gives before it slides keeps a deflection on each winch.
        self.bristles = [
            (i, e.values)
            for i, e in self._each("winch_coulomb_friction")
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
        """The lagged force and the rates of the lag states."""
        force = np.array(limited, dtype=float)
        rates = np.zeros(len(self.lags))
        for k, (i, time_constant) in enumerate(self.lags):
            rates[k] = (force[i] - states[k]) / time_constant
            force[i] = states[k]
        return force, rates

    def lag_at_rest(self, limited: np.ndarray) -> np.ndarray:
        """Lag states that have settled on the given force."""
        return np.array([limited[i] for i, _ in self.lags])

    def bristle_rates(self, reeling_rate: np.ndarray, deflections: np.ndarray) -> np.ndarray:
        """Rates of the deflections (LuGre): v - s0 |v|/g z, where g is the sliding friction."""
        rates = np.zeros(len(self.bristles))
        for k, (i, v) in enumerate(self.bristles):
            rate = reeling_rate[i]
            slip = rate / sliding(v, rate) if rate != 0.0 else v["transition_speed"] / v["force"]
            rates[k] = rate - v["presliding_stiffness"] * slip * deflections[k]
        return rates

    def deliver(
        self, lagged: np.ndarray, reeling_rate: np.ndarray, deflections: np.ndarray
    ) -> np.ndarray:
        """The pull felt by the cables; `reeling_rate` is positive when paying out."""
        force = np.array(lagged, dtype=float)
        for i, effect in self._each("winch_force_gain"):
            force[i] *= 1.0 + effect.values["factor"]
        for i, effect in self._each("winch_force_bias"):
            force[i] += effect.values["bias"]
        pull = force.copy()
        for i, effect in self._each("winch_coulomb_friction"):
            if not effect.values.get("presliding_stiffness", 0.0):
                pull[i] += sliding(effect.values, reeling_rate[i])
        rates = self.bristle_rates(reeling_rate, deflections)
        for (i, v), z, z_rate in zip(self.bristles, deflections, rates, strict=True):
            damping = v.get("presliding_damping", 0.0)
            if v.get("damping_speed", 0.0):
                damping *= math.exp(-((reeling_rate[i] / v["damping_speed"]) ** 2))
            pull[i] += v["presliding_stiffness"] * z + damping * z_rate
        for i, effect in self._each("winch_viscous_friction"):
            pull[i] += effect.values["coefficient"] * reeling_rate[i]
        for i, effect in self._each("winch_stribeck_friction"):
            v, rate = effect.values, reeling_rate[i]
            dry = v["coulomb"] + (v["static"] - v["coulomb"]) * math.exp(
                -((rate / v["stribeck_speed"]) ** 2)
            )
            transition = v.get("transition_speed", 0.0) or v["stribeck_speed"] / 10.0
            pull[i] += dry * math.tanh(rate / transition) + v["viscous"] * rate
        for i, effect in self._each("pulley_capstan_loss"):
            v = effect.values
            pull[i] += v["loss"] * force[i] * math.tanh(reeling_rate[i] / CAPSTAN_SPEED)
        return pull
