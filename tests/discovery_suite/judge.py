"""One answer of `cdpr discover` against the truth of its case."""

import math
from itertools import permutations

ANGLES = {"phase", "direction"}

# A time at which an effect begins or ends is another one from this error (s) on.
OFF_TIME = 1.0

# A parameter is another one where it is off by more than this share of the truth and by more than
# this many of its own standard errors: no chance, and no slip of the error bar.
OFF_SHARE = 0.1
OFF_ERRORS = 5.0


def names(effects, cables):
    """Effects as a set of (id, cable); the same id on all cables is (id, None)."""
    found = {(item["id"], item.get("cable")) for item in effects}
    for kind in {kind for kind, _ in found}:
        every = {(kind, i) for i in range(1, cables + 1)}
        if every <= found:
            found = (found - every) | {(kind, None)}
    return found


def causes(answer, truth):
    """The effects of an answer, without those that a marred recording may be given by name."""
    hidden = {item["id"] for item in truth["effects"]}
    marks = set(truth["acceptable"]) - hidden if truth.get("imperfections") else set()
    return [item for item in answer["effects"] if item["id"] not in marks]


def listed(answer, truth):
    """Whether every true effect stands in an `ambiguous` answer, each in a place of its own."""
    options = []
    for item in causes(answer, truth):
        options.append(_options(item))
    wanted = sorted(names(truth["effects"], truth["cables"]), key=str)
    if len(options) != len(wanted):
        return False
    return any(
        all(name in choice for name, choice in zip(wanted, order, strict=True))
        for order in permutations(options)
    )


def located(answer, truth):
    """Share of the true effects and terms for which a right place is among those reported."""
    reported = {item["where"] for item in answer["located"]}
    wanted = [item["located"] for item in truth["effects"]]
    wanted += [item["targets"] for item in truth["terms"]]
    if not wanted:
        return None
    return sum(bool(reported & set(good)) for good in wanted) / len(wanted)


def _aligned(values, target):
    """Gust parameters with phase and direction turned together to lie next to the truth."""
    if "direction" in target:
        turn = math.remainder(values["direction"]["value"] - target["direction"], 2.0 * math.pi)
        if abs(turn) > 0.5 * math.pi:
            values = {key: dict(value) for key, value in values.items()}
            values["direction"]["value"] += math.pi
            values["phase"]["value"] += math.pi
    return values


def parameter_errors(answer, truth):
    """Errors in standard errors of all compared parameters of effects that were named right."""
    rows = []
    for item in truth["effects"]:
        for found in answer["effects"]:
            if not _alike(found, item):
                continue
            values = _aligned(found["parameters"], item["parameters"])
            for name in item["compare"]:
                target = item["parameters"][name] + _more(truth, item["id"], name)
                entry = values.get(name)
                if entry is None:
                    name = f"{item['id']}.{name}"
                    rows.append({"parameter": name, "found": None, "z": None, "form": item["form"]})
                    continue
                error = entry["value"] - target
                if name in ANGLES:
                    error = math.remainder(error, 2.0 * math.pi)
                deviation = entry.get("standard_error")
                rows.append(
                    {
                        "parameter": f"{item['id']}.{name}",
                        "truth": target,
                        "found": entry["value"],
                        "z": error / deviation if deviation else None,
                        "relative": error / target if target else None,
                        "form": item["form"],
                    }
                )
    return rows


def _more(truth, effect, parameter):
    """What marred recordings add to a parameter: a late pose is late by its stamp as well."""
    if (effect, parameter) != ("pose_sensor_delay", "delay"):
        return 0.0
    return (truth.get("imperfections") or {}).get("pose_late", 0.0)


def _times(item):
    """When a hidden effect, or one of an answer, begins and ends; None: always before, or after."""
    found = item.get("onset")
    if found is not None:
        return tuple(found[key] and found[key]["value"] for key in ("from", "until"))
    return tuple(item.get(key) for key in ("from", "until"))


def _options(found):
    """What an effect of an answer may be as well as itself, as (id, cable)."""
    rivals = found.get("indistinguishable_from", [])
    return {(one["id"], one.get("cable")) for one in [found, *rivals]}


def _same_kind_of_times(found, item):
    """Whether an effect of an answer begins, or not, and ends, or not, as a hidden one does."""
    kinds = [[time is None for time in _times(one)] for one in (found, item)]
    return kinds[0] == kinds[1]


def _alike(found, item):
    """Whether an effect of an answer has id, cable and kind of times of a hidden one."""
    same = (found["id"], found.get("cable")) == (item["id"], item["cable"])
    return same and _same_kind_of_times(found, item)


def onset_errors(answer, truth):
    """Errors (s) of all times at which hidden effects begin and end; None where none was found."""
    errors = []
    for item in truth["effects"]:
        name = (item["id"], item["cable"])
        alike = [
            found
            for found in answer["effects"]
            if name in _options(found) and _same_kind_of_times(found, item)
        ]
        for which, time in enumerate(_times(item)):
            if time is not None:
                errors.append(_times(alike[0])[which] - time if alike else None)
    return errors


def another(row):
    """Whether a compared parameter is not the hidden one: the law is right, but not its numbers."""
    if row["form"] != "same":
        return False
    if row["found"] is None:
        return True
    near = row["relative"] is not None and abs(row["relative"]) <= OFF_SHARE
    return not near and (row["z"] is None or abs(row["z"]) > OFF_ERRORS)


def judge(answer, truth, seconds):
    """One row of the score."""
    found, wanted = (names(all_["effects"], truth["cables"]) for all_ in (answer, truth))
    terms = answer.get("terms", [])
    verdict = answer["verdict"]
    parameters = parameter_errors(answer, truth)
    same_numbers = not any(another(row) for row in parameters)
    onsets = onset_errors(answer, truth)
    same_times = all(error is not None and abs(error) <= OFF_TIME for error in onsets)
    switched = any(time is not None for item in answer["effects"] for time in _times(item))
    same_times = same_times and bool(onsets) == switched
    alone = names(causes(answer, truth), truth["cables"])
    exact = alone == wanted and bool(terms) == bool(truth["terms"])
    exact = exact and same_numbers and same_times
    correct = exact or (verdict == "ambiguous" and same_times and listed(answer, truth))
    gap = answer["gap"]["holdout"]
    row = {
        "case": truth["case"],
        "group": truth["group"],
        "verdict": verdict,
        "truth": sorted(_text(name) for name in wanted),
        "found": sorted(_text(name) for name in found),
        "terms": [f"{term['target']}: {term['expression']}" for term in terms],
        "marred": bool(truth.get("imperfections")),
        "exact": exact,
        "correct": correct,
        "located": located(answer, truth),
        "parameters": parameters,
        "onsets": onsets,
        "ambiguous_truth": truth["ambiguous"],
        "gap_before": gap["before"],
        "gap_after": gap["after"],
        "seconds": seconds,
    }
    if truth["group"] in ("null", "outside", "moordyn"):
        # Nothing of the catalogue is there to be named.
        wrong = [e for e in answer["effects"] if e["id"] not in truth["acceptable"]]
        invented = terms if truth["group"] == "null" else []
        row["false_alarms"] = len(wrong) + len(invented)
        row["correct"] = row["false_alarms"] == 0
    if truth["group"] == "null":
        nothing = verdict == "no_missing_effect"
        delay_alone = row["marred"] and bool(answer["effects"]) and verdict == "named"
        row["exact"] = row["correct"] and (nothing or delay_alone)
        row["chance"] = answer["search"]["null_test"]
    if truth["group"] == "moordyn":
        row["gained"] = gap["after"] < gap["before"]
    if truth["group"] == "outside":
        row["halved"] = gap["after"] <= max(0.5 * gap["before"], 1.1)
        row["exact"] = row["correct"] and verdict == "unnamed"
    if truth["group"] == "near_threshold":
        silent = not found and not terms
        row["correct"] = correct or silent
    return row


def failed(truth, seconds, reason):
    """The row of a case on which the program failed."""
    return {
        "case": truth["case"],
        "group": truth["group"],
        "verdict": f"failed: {reason}",
        "truth": sorted(_text(name) for name in names(truth["effects"], truth["cables"])),
        "found": [],
        "terms": [],
        "marred": bool(truth.get("imperfections")),
        "exact": False,
        "correct": False,
        "located": 0.0,
        "parameters": [],
        "onsets": [None for item in truth["effects"] for t in _times(item) if t is not None],
        "ambiguous_truth": truth["ambiguous"],
        "gap_before": None,
        "gap_after": None,
        "seconds": seconds,
        "halved": False,
        "false_alarms": None,
    }


def _text(name):
    kind, cable = name
    return kind if cable is None else f"{kind}[{cable}]"
