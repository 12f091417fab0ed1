"""`cdpr discover` on a point on four rigid cables: lengths alone, half of the commands logged."""

from __future__ import annotations

import json

import pytest

from outside import point_robot


def searched(cdpr, folder, seed, **hidden):
    """What is found on a recording."""
    point_robot.write(folder, point_robot.record(seed, **hidden))
    done = cdpr(
        *("discover", "--data", "run.csv", "--model", "model.toml", "--out", "found"),
        cwd=folder,
        timeout=280,
    )
    assert done.returncode == 0, done.stderr
    return json.loads((folder / "found" / "discovery.json").read_text(encoding="utf-8"))


def test_nothing_is_missing_where_the_log_missed_a_jerk(cdpr, tmp_path):
    """The waves are at their full size from 3 s on: their forces changed between two rows."""
    found = searched(cdpr, tmp_path, 100)
    assert found["verdict"] == "no_missing_effect", found["effects"]


def test_a_steady_wind_is_found_though_its_torque_shows_in_nothing(cdpr, tmp_path):
    found = searched(cdpr, tmp_path, 112, wind=(2.0, 0.0))
    assert found["verdict"] == "named"
    (wind,) = found["effects"]
    assert (wind["id"], wind["cable"]) == ("steady_wind", None)
    for name, truth in (("force_x", 2.0), ("force_y", 0.0)):
        size = wind["parameters"][name]
        assert size["value"] == pytest.approx(truth, abs=4.0 * size["standard_error"])
    assert wind["parameters"]["torque"]["value"] == 0.0


def test_a_bias_stands_alone_where_anchors_and_zeros_are_off(cdpr, tmp_path):
    """It came out as two, one until 3.4 s and one from then on."""
    found = searched(cdpr, tmp_path, 206, bias=2.0, off=0.6)
    assert found["verdict"] in ("named", "partly_named")
    (bias,) = found["effects"]
    assert (bias["id"], bias["cable"]) == ("winch_force_bias", None)
    assert bias["parameters"]["bias"]["value"] == pytest.approx(2.0, abs=0.1)
    assert len(found["calibration"]) >= 8
