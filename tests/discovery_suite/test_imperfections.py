"""Imperfections of a recording: each does what it says, and nothing else."""

from dataclasses import fields

import numpy as np
import pytest

from . import trial
from .cases_field import BENCH, BENCH_SIZES, FIELD, SHARE, SIZES, drawn
from .cases_realistic import IMPERFECT, REALISTIC
from .imperfections import ANGLE, Imperfections, apply, gauss_markov, wander


@pytest.fixture(scope="module")
def record():
    """Twenty seconds of the nominal robot."""
    return trial.run(trial.Settings(seed=5, duration=20.0))


def test_nothing_is_changed_where_nothing_is_asked(record):
    written = apply(record, Imperfections())
    assert np.array_equal(written.forces, record.forces)
    assert np.allclose(written.time, record.dt * np.arange(len(record.states)))
    for name, readings in record.columns.items():
        assert np.allclose(written.columns[name], readings, rtol=0.0, atol=1e-12)


def test_noise_with_memory_has_its_size_and_time_constant():
    noise = gauss_markov(np.random.default_rng(1), 200_000, 0.02, 3e-3, 0.4)
    assert noise.std() == pytest.approx(3e-3, rel=0.05)
    lag = np.mean(noise[20:] * noise[:-20]) / np.mean(noise**2)
    assert lag == pytest.approx(np.exp(-1.0), abs=0.05)


def test_a_wander_begins_at_zero_and_is_slow():
    drift = wander(np.random.default_rng(2), 5001, 0.01)
    assert drift[0] == 0.0
    assert np.sqrt(np.mean(drift**2)) == pytest.approx(0.01)
    assert np.abs(np.diff(drift)).max() < 1e-4


def test_late_lengths_are_those_of_then(record):
    written = apply(record, Imperfections(lengths_late=2 * record.dt))
    name = "unstretched_length[1]"
    errors = record.columns[name] - record.clean[name]
    shown = written.columns[name] - errors
    assert np.allclose(shown[2:], record.clean[name][:-2], atol=1e-9)
    assert np.array_equal(written.columns["x"], record.columns["x"])


def test_stamps_jitter_and_still_increase(record):
    written = apply(record, Imperfections(jitter=4e-3))
    steps = np.diff(written.time)
    assert steps.min() > 0.0
    assert np.std(written.time - record.dt * np.arange(len(written.time))) == pytest.approx(
        4e-3, rel=0.1
    )


def test_readings_are_whole_counts(record):
    written = apply(record, Imperfections(pose_count=1e-2, length_count=5e-3))
    for name, count in [("x", 1e-2), ("phi", ANGLE * 1e-2), ("unstretched_length[2]", 5e-3)]:
        multiples = written.columns[name] / count
        assert np.allclose(multiples, np.round(multiples), atol=1e-6)


def test_recorded_forces_are_not_those_that_the_robot_felt(record):
    written = apply(record, Imperfections(force_noise=50.0))
    assert np.std(written.forces - record.forces) == pytest.approx(50.0, rel=0.1)


def test_every_imperfection_has_a_case():
    for field in fields(Imperfections):
        default = getattr(Imperfections(), field.name)
        # Time constants and the share of the angle go with others.
        if not field.name.endswith(("memory", "angle")):
            assert any(getattr(it, field.name) != default for it in IMPERFECT.values()), field.name
    assert {case.group for case in REALISTIC} == {"null", "single"}


def test_field_cases_are_drawn_from_their_names_within_the_bounds():
    assert drawn("field_gain_2") == drawn("field_gain_2")
    assert drawn("field_gain_2") != drawn("field_gain_all")
    for of, sizes in [(of, SIZES) for of in FIELD] + [(of, BENCH_SIZES) for of in BENCH]:
        it = of.train[0].imperfections
        assert it == of.holdout.imperfections
        for kind, (least, most) in sizes.items():
            assert getattr(it, kind) == 0.0 or least <= getattr(it, kind) <= most
        assert not (it.pose_late and it.lengths_late)
    noisy = [of.train[0].imperfections.force_noise > 0.0 for of in FIELD]
    assert np.mean(noisy) == pytest.approx(SHARE, abs=0.15)
