"""What happens between the commanded winch force and the pull that the cable feels.

The order is: command, delay, saturation, lag, gain, bias, losses.
"""

from __future__ import annotations

import math

import numpy as np

from .parameters import CABLES, Parameters

CAPSTAN_SPEED = 0.01  # m/s, where the capstan loss changes its sign


class WinchChain:
    """The effects that sit on the four winches."""

    def __init__(self, parameters: Parameters):
        self.parameters = parameters
        self.delays = np.zeros(CABLES)
        for i, effect in self._each("winch_delay"):
            self.delays[i] += effect.values["delay"]
        # One lag is one state; several on one winch follow each other.
        self.lags = [(i, e.values["time_constant"]) for i, e in self._each("winch_lag")]

    def _each(self, effect_id: str):
        for effect in self.parameters.find(effect_id):
            for i in range(CABLES):
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

    def deliver(self, lagged: np.ndarray, reeling_rate: np.ndarray) -> np.ndarray:
        """The pull felt by the cables; `reeling_rate` is positive when paying out."""
        force = np.array(lagged, dtype=float)
        for i, effect in self._each("winch_force_gain"):
            force[i] *= 1.0 + effect.values["factor"]
        for i, effect in self._each("winch_force_bias"):
            force[i] += effect.values["bias"]
        pull = force.copy()
        for i, effect in self._each("winch_coulomb_friction"):
            v = effect.values
            speed, tail = reeling_rate[i] / v["transition_speed"], v.get("tail", 0.0)
            slow = 2.0 / math.pi * math.atan(math.pi * speed / 2.0)
            pull[i] += v["force"] * ((1.0 - tail) * math.tanh(speed) + tail * slow)
        for i, effect in self._each("winch_viscous_friction"):
            pull[i] += effect.values["coefficient"] * reeling_rate[i]
        for i, effect in self._each("winch_stribeck_friction"):
            v, rate = effect.values, reeling_rate[i]
            dry = v["coulomb"] + (v["static"] - v["coulomb"]) * math.exp(
                -((rate / v["stribeck_speed"]) ** 2)
            )
            pull[i] += dry * math.tanh(10.0 * rate / v["stribeck_speed"]) + v["viscous"] * rate
        for i, effect in self._each("pulley_capstan_loss"):
            v = effect.values
            pull[i] += v["loss"] * force[i] * math.tanh(reeling_rate[i] / CAPSTAN_SPEED)
        return pull
