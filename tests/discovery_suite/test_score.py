"""The judge and the score of marred recordings, on answers made by hand."""

import pytest

from .judge import judge
from .score import summary

TRUTH = {
    "case": "field_x",
    "group": "single",
    "cables": 4,
    "effects": [
        {
            "id": "platform_mass",
            "cable": None,
            "parameters": {"mass": 120.0},
            "compare": ["mass"],
            "form": "same",
            "located": ["platform.force_x"],
        }
    ],
    "terms": [],
    "ambiguous": "no",
    "alternatives": [],
    "acceptable": ["pose_sensor_delay"],
    "imperfections": {"pose_late": 0.02},
}


def effect(kind, **parameters):
    entries = {
        name: {"value": value, "standard_error": error}
        for name, (value, error) in parameters.items()
    }
    return {"id": kind, "cable": None, "parameters": entries, "indistinguishable_from": []}


def answer(verdict, *effects, gap=1.0):
    gaps = {"holdout": {"before": 5.0, "after": gap}}
    return {
        "search": {"null_test": None},
        "verdict": verdict,
        "effects": list(effects),
        "terms": [],
        "located": [],
        "gap": gaps,
    }


MASS = effect("platform_mass", mass=(121.0, 0.9))
DELAY = effect("pose_sensor_delay", delay=(0.02, 1e-4))
DRAG = effect("platform_linear_drag", coefficient=(3.0, 0.5))


def row(truth, *args, **gap):
    return judge(answer(*args, **gap), truth, 1.0)


def test_a_late_pose_may_have_its_name_beside_what_is_hidden():
    assert row(TRUTH, "named", MASS, DELAY)["exact"]
    assert not row(TRUTH, "named", MASS, DELAY, DRAG)["correct"]
    clean = dict(TRUTH, imperfections={})
    assert not row(clean, "named", MASS, DELAY)["correct"]


def test_a_hidden_delay_of_a_late_pose_is_the_sum_of_both():
    hidden = {"id": "pose_sensor_delay", "parameters": {"delay": 0.08}, "compare": ["delay"]}
    truth = TRUTH | {"effects": [TRUTH["effects"][0] | hidden]}
    for delay, right in [(0.1, True), (0.08, False)]:
        found = effect("pose_sensor_delay", delay=(delay, 1e-4))
        assert row(truth, "named", found)["correct"] == right


def test_with_nothing_hidden_only_the_delay_may_be_named():
    nothing = dict(TRUTH, group="null", effects=[])
    assert row(nothing, "named", DELAY)["exact"]
    assert row(nothing, "no_missing_effect")["exact"]
    unsure = row(nothing, "unnamed")
    assert unsure["correct"]
    assert not unsure["exact"]
    assert not row(nothing, "named", DELAY, DRAG)["correct"]


def test_marred_recordings_are_counted_by_themselves():
    nothing = dict(TRUTH, group="null", effects=[])
    rows = [
        row(TRUTH, "named", MASS, DELAY),
        row(TRUTH, "named", MASS, DRAG, gap=2.0),
        row(nothing, "no_missing_effect"),
        row(dict(TRUTH, imperfections={}, acceptable=[]), "named", MASS),
    ]
    score = summary(rows)
    marred = score["marred"]
    assert score["exact_single"] == {"n": 1, "rate": 1.0}
    assert score["null_trials"] == 0
    assert marred["correct_single"] == {"n": 2, "rate": 0.5}
    assert marred["null_no_cause"] == {"n": 1, "rate": 1.0}
    assert marred["named_at_noise"] == {"n": 2, "rate": 0.5}
    assert marred["parameters_within_2"] == {"n": 2, "rate": 1.0}
    assert marred["correct_pair_triple"] is None


def test_an_effect_that_begins_must_be_found_with_its_time():
    begun = dict(TRUTH, imperfections={}, acceptable=[], group="onset")
    begun["effects"] = [dict(TRUTH["effects"][0], **{"from": 40.0})]

    def since(time, error=0.05):
        onset = {"from": {"value": time, "standard_error": error}, "until": None}
        return dict(MASS, onset=onset)

    right = row(begun, "named", since(40.3))
    assert right["exact"]
    assert right["onsets"] == [pytest.approx(0.3)]
    assert not row(begun, "named", since(44.0))["correct"]
    always = row(begun, "named", MASS)
    assert not always["correct"]
    assert always["onsets"] == [None]
    assert not row(dict(TRUTH, imperfections={}), "named", since(40.0))["correct"]
    rival = {"id": "platform_mass", "cable": None}
    rivalled = dict(since(40.1), id="cable_axial_mass", indistinguishable_from=[rival])
    assert row(begun, "ambiguous", rivalled)["correct"]
    assert not row(begun, "ambiguous", dict(rivalled, onset=since(44.0)["onset"]))["correct"]
    score = summary([right, always])
    assert score["onset_within_1_s"] == {"n": 2, "rate": 0.5}
    assert score["correct_onset"] == {"n": 2, "rate": 0.5}


def test_chance_is_counted_by_the_control_runs_that_do_as_well_where_nothing_is_hidden():
    nothing = dict(TRUTH, group="null", effects=[])

    def tested(as_strong):
        found = answer("no_missing_effect")
        found["search"] = {"null_test": {"as_strong": as_strong, "shifts": 99}}
        return judge(found, nothing, 1.0)

    short = answer("no_missing_effect")
    short["search"] = {"null_test": None}
    rows = [tested(0), tested(9), tested(60), judge(short, nothing, 1.0)]
    chance = summary(rows)["chance"]
    assert chance["n"] == 3
    assert chance["below"] == {
        0.02: pytest.approx(1 / 3),
        0.1: pytest.approx(2 / 3),
        0.25: pytest.approx(2 / 3),
        0.5: pytest.approx(2 / 3),
        0.75: 1.0,
    }
