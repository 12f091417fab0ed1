"""`cdpr discover` on recordings as machines make them: coloured, late, with forces in error."""

from __future__ import annotations

import json

import pytest

from discovery_suite import trial
from discovery_suite.cases import effect
from discovery_suite.imperfections import Imperfections

SETTINGS = trial.Settings(seed=21, duration=60.0, rate=25.0, lead_in=12.0)
LATE = 0.03
FORCE_ERROR = 40.0
MARRED = Imperfections(
    pose_colour=5e-3,
    pose_memory=0.5,
    lengths_late=LATE,
    force_noise=FORCE_ERROR,
    pose_drift=5e-3,
)
GAIN = effect("winch_force_gain", 2, factor=-0.02)


@pytest.fixture(scope="module", params=[[], [GAIN]], ids=["nothing_hidden", "gain_hidden"])
def searched(request, cdpr, tmp_path_factory):
    """What is hidden in two recordings, and what is found."""
    folder = tmp_path_factory.mktemp("marred")
    for name, changes in (("run", {}), ("check", {"seed": 22, "duration": 40.0})):
        settings = SETTINGS.but(imperfections=MARRED, **changes)
        trial.write_csv(trial.run(settings, request.param), folder / f"{name}.csv")
    cdpr(
        *("discover", "--data", "run.csv", "--holdout", "check.csv", "--out", "found"),
        cwd=folder,
        timeout=280,
    )
    answer = (folder / "found" / "discovery.json").read_text(encoding="utf-8")
    return request.param, json.loads(answer)


def test_what_is_hidden_is_found_and_nothing_else(searched):
    hidden, answer = searched
    # With forces so uncertain a bias of the mean force fits nearly as well as a gain.
    assert answer["verdict"] in (["named", "ambiguous"] if hidden else ["no_missing_effect"])
    found = [(one["id"], one["cable"]) for one in answer["effects"]]
    assert found == [(one["id"], one["cable"]) for one in hidden]
    for one, truth in zip(answer["effects"], hidden, strict=True):
        factor = one["parameters"]["factor"]
        error = abs(factor["value"] - truth["parameters"]["factor"])
        assert error < 3.0 * factor["standard_error"]


def test_late_clocks_and_errors_of_the_forces_are_told_with_their_sizes(searched):
    _, answer = searched
    instruments = answer["instruments"]
    delay = instruments["channels"]["unstretched_length[1]"]["delay"]
    assert abs(delay["value"] - LATE) < 2e-3
    assert instruments["winch_force_error"]["value"] == pytest.approx(FORCE_ERROR, rel=0.15)


def test_what_is_left_is_noise(searched):
    _, answer = searched
    assert answer["gap"]["holdout"]["after"] < 1.2
