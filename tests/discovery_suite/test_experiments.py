"""`cdpr experiment` from recordings that leave two laws open to recordings that tell them apart."""

from dataclasses import replace

import numpy as np
import pytest

from . import experiments
from .trial import planned

KNOWN = {item.case.name: item for item in experiments.EXPERIMENTS}
GAIN = replace(
    KNOWN["open_gain_bias"],
    limits={**KNOWN["open_gain_bias"].limits, "duration": 60.0, "interval": 0.1},
)


@pytest.mark.slow
def test_what_was_ambiguous_is_told_apart_whichever_is_true(cdpr_bin, tmp_path):
    row = experiments.run(GAIN, cdpr_bin, tmp_path)
    assert set(row["open"]) == {"winch_force_gain[1]", "winch_force_bias[1]"}
    assert row["exit_code"] == 0, row["plan"]
    assert all(told["right"] for told in row["after"].values()), row["after"]
    keeps_to(GAIN.limits, tmp_path / GAIN.case.name / "plan.csv")


def keeps_to(limits, path):
    table = np.genfromtxt(path, delimiter=",", names=True, deletechars="")
    for axis in ("x", "y", "phi"):
        low, high = limits[axis]
        assert low - 1e-9 <= table[axis].min()
        assert table[axis].max() <= high + 1e-9
    assert np.hypot(table["vx"], table["vy"]).max() <= limits["speed"]
    assert np.abs(table["omega"]).max() <= limits["angular_speed"]
    low, high = limits["tension"]
    tensions = [table[name] for name in table.dtype.names if name.startswith("tension")]
    assert low <= np.min(tensions)
    assert np.max(tensions) <= high
    # The speeds are those of the poses.
    step = np.diff(table["time"])
    slopes = np.diff(table["x"]) / step
    assert np.abs(slopes - 0.5 * (table["vx"][1:] + table["vx"][:-1])).max() < 1e-2


def test_a_plan_is_held_before_it_begins(tmp_path):
    path = tmp_path / "plan.csv"
    names = "time,x,y,phi,vx,vy,omega,ax,ay,alpha,winch_force[1],winch_force[2],tension[1]"
    path.write_text(f"{names}\n0,1,2,3,0,0,0,0,0,0,100,300,5\n1,2,2,3,4,0,0,5,0,0,200,500,5\n")
    reference, mean = planned(path, 3)
    assert reference[:, 0, 0].tolist() == [1.0, 1.0, 2.0]
    assert reference[2].tolist() == [[2.0, 2.0, 3.0], [4.0, 0.0, 0.0], [5.0, 0.0, 0.0]]
    assert mean.tolist() == [200.0, 200.0, 350.0]
