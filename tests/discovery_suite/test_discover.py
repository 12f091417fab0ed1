"""`cdpr discover` on the small subset of the suite: one case of each kind."""

import pytest

from . import suite
from .score import run_case

SMALL = suite.select(small=True)


@pytest.fixture(scope="module")
def row(request, cdpr_bin, tmp_path_factory):
    folder = tmp_path_factory.mktemp("discovery")
    return run_case(request.param, cdpr_bin, folder / "data", folder / "results", timeout=240.0)


@pytest.mark.slow
@pytest.mark.parametrize("row", SMALL, indirect=True, ids=[case.name for case in SMALL])
def test_small_subset(row):
    assert row["correct"], row
    assert not row.get("false_alarms"), row
    if row["group"] == "outside":
        assert row["verdict"] == "unnamed"
        assert row["halved"], row
        return
    assert row["gap_after"] <= 1.1
    if row["located"] is not None:
        assert row["located"] == 1.0
    exact = [p for p in row["parameters"] if p["form"] == "same"]
    # Three standard errors: one in four hundred would miss two for each parameter of every run.
    assert all(abs(p["z"]) < 3.0 for p in exact), exact
