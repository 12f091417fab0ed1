"""How strongly the hidden effect shows: the size that decides whether a case is fair.

The plant without the effect is replayed under the recorded inputs, restarted every `horizon`
seconds from the true state. The root mean square of its distance from the effect's readings, in
standard deviations of the sensor noise, is the effect's strength; a model without the effect then
shows a gap of about `sqrt(1 + strength^2)`. An estimator of the state sees somewhat less.
"""

import numpy as np

from . import parameters
from .plant import derivative, lengths, replay


def readings(record, params, states, forces, recorded, hidden):
    """Noise-free readings of the record's channels in these states, by column name."""
    n = len(states)
    chords, tensions = np.empty((n, 4)), np.empty((n, 4))
    rate = np.zeros(states.shape[1])
    for k in range(n):
        lengths(params, states[k], chords[k])
        derivative(params, 0.0, states[k], forces[k], recorded[k] + hidden[k], rate, tensions[k])
    out = {"x": states[:, 0], "y": states[:, 1], "phi": states[:, 2]}
    unstretched = chords if params.rigid else states[:, 6:10]
    for i in range(4):
        out[f"cable_length[{i + 1}]"] = chords[:, i]
        out[f"unstretched_length[{i + 1}]"] = unstretched[:, i]
        out[f"tension[{i + 1}]"] = tensions[:, i]
    return {name: out[name] for name in record.columns}


def strength(record, clean, cable_model="lumped_mass", horizon=5.0):
    """Root mean square of (nominal model - effect's readings) / noise, overall and by channel.

    `clean` holds the same trial's readings without noise, gaps and outliers.
    """
    nominal = parameters.build((), cable_model)
    size = max(int(round(horizon / record.dt)), 1)
    n = len(record.states)
    total = {name: 0.0 for name in record.columns}
    count = 0
    for first in range(0, n - 1, size):
        last = min(first + size, n - 1)
        states = replay(
            nominal,
            0.0,
            record.dt,
            1e-3,
            record.states[first],
            first,
            last,
            record.forces,
            record.recorded,
            record.hidden,
        )
        window = slice(first, last + 1)
        found = readings(
            record,
            nominal,
            states,
            record.forces[window],
            record.recorded[window],
            record.hidden[window],
        )
        for name, values in found.items():
            total[name] += np.sum(((values - clean[name][window]) / record.noise[name]) ** 2)
        count += last - first + 1
    channels = {name: float(np.sqrt(value / count)) for name, value in total.items()}
    return float(np.sqrt(np.mean(np.square(list(channels.values()))))), channels
