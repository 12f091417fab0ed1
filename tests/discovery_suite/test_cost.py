"""The table of costs."""

from .cost import Cost, lasting, markdown
from .suite import select


def test_ratios_are_of_a_sample():
    """Ten times as long at ten times the cost is the same."""
    costs = [Cost("short", 1000, 2.0, 1.0, 5e7), Cost("long", 10_000, 20.0, 10.0, 2.5e8)]
    long = markdown(costs).splitlines()[-1].split(" | ")
    assert long[4:6] == ["2000", "1.00"]
    assert long[7:] == ["25.0", "0.50 |"]


def test_every_trial_of_a_case_lasts_so_long():
    case = lasting(select(["null_00"])[0], 7.0)
    assert {settings.duration for settings in (*case.train, case.holdout)} == {7.0}
