"""Run `cdpr discover` on cases and sum up how well it did."""

import json
import subprocess
import time
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path
from statistics import median

from .generate import write_case
from .judge import OFF_TIME, failed, judge

CATALOGUE = ("single", "pair", "triple", "elasticity", "look_alike")
#: Held-out gap up to which nothing is left, as a multiple of what the true model leaves.
ALLOWED = 1.1


def _command(binary, case, folder, model, out):
    train = [str(folder / f"train{i + 1}.csv") for i in range(len(case.train))]
    command = [str(binary), "discover", "--data", *train]
    command += ["--holdout", str(folder / "holdout.csv")]
    command += ["--model", str(model), "--out", str(out)]
    # An answer of an earlier run must not be judged in place of a missing one.
    (out / "discovery.json").unlink(missing_ok=True)
    return command


def truth_model(truth, given):
    """The model file `given` with what is hidden; None where no model file says it."""
    if not truth["effects"] or truth["terms"]:
        return None
    lines = [given.rstrip()]
    for effect in truth["effects"]:
        lines += ["[[effect]]", f'id = "{effect["id"]}"']
        lines += [f"cable = {effect['cable']}"] if effect["cable"] else []
        lines += [f'channel = "{effect["channel"]}"'] if "channel" in effect else []
        lines += [f"{name} = {float(value)!r}" for name, value in effect["parameters"].items()]
    return "\n".join(lines) + "\n"


def gap_of_truth(case, binary, folder, out, truth, timeout):
    """The held-out gap with the true model: what is random and not recorded keeps it above 1."""
    text = truth_model(truth, (folder / "model.toml").read_text(encoding="utf-8"))
    if text is None:
        return None
    out.mkdir(parents=True, exist_ok=True)
    model = out / "truth.toml"
    model.write_text(text, encoding="utf-8")
    command = _command(binary, case, folder, model, out)
    subprocess.run(command, capture_output=True, timeout=timeout, check=True)
    answer = json.loads((out / "discovery.json").read_text(encoding="utf-8"))
    return answer["gap"]["holdout"]["before"]


def run_case(case, binary, data, results, timeout):
    """Generate a case unless its data are there, run the program on it, and judge the answer."""
    folder, out = Path(data) / case.name, Path(results) / case.name
    if not (folder / "truth.json").exists():
        write_case(case, data)
    truth = json.loads((folder / "truth.json").read_text(encoding="utf-8"))
    command = _command(binary, case, folder, folder / "model.toml", out)
    began = time.perf_counter()
    try:
        done = subprocess.run(command, capture_output=True, text=True, timeout=timeout, check=False)
    except subprocess.TimeoutExpired:
        return failed(truth, timeout, f"no answer within {timeout:.0f} s")
    seconds = time.perf_counter() - began
    if done.returncode != 0:
        last = (done.stderr.strip().splitlines() or ["no message"])[-1]
        return failed(truth, seconds, f"exit code {done.returncode}, {last}")
    try:
        answer = json.loads((out / "discovery.json").read_text(encoding="utf-8"))
        row = judge(answer, truth, seconds)
        if case.group in CATALOGUE and row["gap_after"] > ALLOWED:
            row["gap_truth"] = gap_of_truth(case, binary, folder, out / "truth", truth, timeout)
        return row
    except (OSError, KeyError, TypeError, ValueError, subprocess.SubprocessError) as error:
        return failed(truth, seconds, f"discovery.json: {type(error).__name__} {error}")


def _rate(rows, key):
    rows = [row for row in rows if row.get(key) is not None]
    return (
        {"n": len(rows), "rate": sum(float(row[key]) for row in rows) / len(rows)} if rows else None
    )


#: Measures of marred recordings: key, words, target.
MARRED = (
    ("null_no_cause", "nothing hidden: no cause named", "99 %"),
    ("null_nothing", "nothing hidden: nothing said to be missing but a delay", "95 %"),
    ("correct_single", "one effect: right or rightly ambiguous", "92 %"),
    ("correct_pair_triple", "two or three effects: right or rightly ambiguous", "80 %"),
    ("parameters_within_2", "parameters within 2 standard errors", "90 %"),
    ("named_at_noise", "`named`: at most 1.5 times the noise left", "100 %"),
)
#: Gap from which more than the noise is left.
MORE_THAN_NOISE = 1.5


def summary_of_marred(rows):
    """The score of recordings with imperfections; a measure without a row is None."""

    def of(*groups):
        return [row for row in rows if row["group"] in groups]

    same = [p for row in rows for p in row["parameters"] if p["form"] == "same"]
    within = [{"within": abs(p["z"]) <= 2.0} for p in same if p["z"] is not None]
    named = [row for row in rows if row["verdict"] == "named"]
    at_noise = [{"at_noise": row["gap_after"] <= MORE_THAN_NOISE} for row in named]
    return {
        "null_no_cause": _rate(of("null"), "correct"),
        "null_nothing": _rate(of("null"), "exact"),
        "correct_single": _rate(of("single"), "correct"),
        "correct_pair_triple": _rate(of("pair", "triple"), "correct"),
        "parameters_within_2": _rate(within, "within"),
        "named_at_noise": _rate(at_noise, "at_noise"),
    }


#: Shares of the control runs that are to explain as much as the best candidate of a null in as
#: large a share of the nulls.
CHANCE_SHARES = (0.02, 0.1, 0.25, 0.5, 0.75)


def summary_of_chance(rows):
    """How often chance explains as much as the best candidate where nothing is hidden.

    By each of `CHANCE_SHARES` the share of nulls in which no more control runs than that do, which
    is the same where the test is right, below it where it errs on the safe side; None where no null
    was tested.
    """
    tests = [row["chance"] for row in rows if row.get("chance")]
    if not tests:
        return None
    # The recording as it is counts as one more run.
    ranks = [(test["as_strong"] + 1) / (test["shifts"] + 1) for test in tests]
    below = {share: sum(rank <= share for rank in ranks) / len(ranks) for share in CHANCE_SHARES}
    return {"n": len(ranks), "below": below}


def summary(rows):
    """The score from the rows: a flat dictionary, ready for JSON.

    Recordings with imperfections have measures of their own, under `marred`.
    """
    every, marred = rows, [row for row in rows if row["marred"]]
    rows = [row for row in rows if not row["marred"]]

    def of(*groups):
        return [row for row in rows if row["group"] in groups]

    nulls, outside = of("null"), of("outside")
    errors = [p for row in rows for p in row["parameters"]]
    known = [row for row in of(*CATALOGUE) if row["gap_after"] is not None]
    gaps = [row["gap_after"] for row in known]
    best = [row["gap_after"] / max(row.get("gap_truth") or 1.0, 1.0) for row in known]
    out = {
        "exact_single": _rate(of("single"), "exact"),
        "exact_pair_triple": _rate(of("pair", "triple"), "exact"),
        "exact_elasticity": _rate(of("elasticity"), "exact"),
        "correct_single": _rate(of("single"), "correct"),
        "correct_pair_triple": _rate(of("pair", "triple"), "correct"),
        "correct_elasticity": _rate(of("elasticity"), "correct"),
        "correct_look_alike": _rate(of("look_alike"), "correct"),
        "near_threshold_not_wrong": _rate(of("near_threshold"), "correct"),
        "located": _rate(of(*CATALOGUE, "outside"), "located"),
        "null_trials": len(nulls),
        "null_failed": sum(row["false_alarms"] is None for row in nulls),
        "exact_null": _rate(nulls, "exact"),
        "false_alarms": sum(bool(row["false_alarms"]) for row in nulls),
        "outside_not_named": _rate(outside, "correct"),
        "outside_halved": _rate(outside, "halved"),
        "moordyn_no_wrong_cause": _rate(of("moordyn"), "correct"),
        "moordyn_gained": _rate(of("moordyn"), "gained"),
        "gap_after_median": median(gaps) if gaps else None,
        "gap_after_max": max(gaps) if gaps else None,
        "gap_after_within_1.1": sum(g <= ALLOWED for g in gaps) / len(gaps) if gaps else None,
        "gap_of_truth_within_1.1": sum(g <= ALLOWED for g in best) / len(best) if best else None,
        "correct_onset": _rate(of("onset"), "correct"),
        "onset_within_1_s": _within(of("onset")),
        "marred": summary_of_marred(marred),
        "chance": summary_of_chance([row for row in every if row["group"] == "null"]),
        "seconds_median": median(row["seconds"] for row in every),
        "seconds_max": max(row["seconds"] for row in every),
        "cases": len(every),
        "failed": sum(row["verdict"].startswith("failed") for row in every),
    }
    for form in ("same", "other"):
        z = [abs(p["z"]) for p in errors if p["form"] == form and p["z"] is not None]
        out[f"parameters_{form}_law"] = {
            "n": len(z),
            "within_2": sum(v <= 2.0 for v in z) / len(z) if z else None,
            "median": median(z) if z else None,
            "without_error_bar": sum(p["z"] is None for p in errors if p["form"] == form),
        }
    out["ambiguous"] = {}
    for kind in ("expected", "allowed", "no"):
        group = [row for row in of(*CATALOGUE) if row["ambiguous_truth"] == kind]
        said = [row for row in group if row["verdict"] == "ambiguous"]
        out["ambiguous"][kind] = {
            "cases": len(group),
            "said": len(said),
            "said_with_truth_listed": sum(row["correct"] for row in said),
        }
    return out


def _within(rows):
    """Of all times at which hidden effects begin or end the share that was found within 1 s."""
    errors = [error for row in rows for error in row["onsets"]]
    near = sum(error is not None and abs(error) <= OFF_TIME for error in errors)
    return {"n": len(errors), "rate": near / len(errors)} if errors else None


def _share(entry):
    return "-" if entry is None else f"{100.0 * entry['rate']:.0f} % of {entry['n']}"


def _chance(entry):
    if entry is None:
        return "-"
    shares = (f"{below:.1%} by {share:.0%}" for share, below in entry["below"].items())
    return f"{', '.join(shares)} of {entry['n']}"


def _number(value, form=".3g"):
    return "-" if value is None else format(value, form)


def _of_truth(row):
    gap = row.get("gap_truth")
    return "" if gap is None else f" (truth: {_number(gap)})"


def markdown(score, rows):
    """The score table, then one row per case."""
    same, other = score["parameters_same_law"], score["parameters_other_law"]

    def within(entry):
        if not entry["n"]:
            return "-"
        return (
            f"{100.0 * entry['within_2']:.0f} % of {entry['n']}, "
            f"median {entry['median']:.2f} standard errors"
        )

    lines = [
        "| measure | result | target |",
        "| --- | --- | --- |",
        f"| exact set, single effects | {_share(score['exact_single'])} | |",
        f"| exact set, pairs and triples | {_share(score['exact_pair_triple'])} | |",
        f"| exact set, elasticity | {_share(score['exact_elasticity'])} | |",
        f"| right or rightly ambiguous, single | {_share(score['correct_single'])} | 95 % |",
        f"| right or rightly ambiguous, pairs and triples "
        f"| {_share(score['correct_pair_triple'])} | 85 % |",
        f"| right or rightly ambiguous, elasticity | {_share(score['correct_elasticity'])} | |",
        f"| right or rightly ambiguous, look-alikes | {_share(score['correct_look_alike'])} | |",
        f"| near the threshold: right or silent | {_share(score['near_threshold_not_wrong'])} | |",
        f"| right place reported | {_share(score['located'])} | |",
        f"| null trials with a false alarm | {score['false_alarms']} of {score['null_trials']} "
        f"(failed: {score['null_failed']}) | 1 of 60 |",
        f"| null trials where nothing is said to be missing | {_share(score['exact_null'])} | |",
        f"| outside the catalogue: nothing named | {_share(score['outside_not_named'])} | 100 % |",
        f"| outside the catalogue: gap halved | {_share(score['outside_halved'])} | 100 % |",
        f"| distributed cables (MoorDyn): no wrong cause "
        f"| {_share(score['moordyn_no_wrong_cause'])} | 100 % |",
        f"| distributed cables (MoorDyn): gap smaller "
        f"| {_share(score['moordyn_gained'])} | 100 % |",
        f"| parameters within 2 standard errors, same law | {within(same)} | 90 % |",
        f"| parameters within 2 standard errors, other smoothing | {within(other)} | |",
        f"| held-out gap after, catalogue | median {_number(score['gap_after_median'])}, "
        f"max {_number(score['gap_after_max'])}, "
        f"at most 1.1 in {_number(score['gap_after_within_1.1'], '.0%')} | 1.1 |",
        f"| the same over the gap that the true model leaves, where that is above 1 "
        f"| at most 1.1 in {_number(score['gap_of_truth_within_1.1'], '.0%')} | |",
        f"| effects that begin or end: right | {_share(score['correct_onset'])} | |",
        f"| times at which they do, within 1 s | {_share(score['onset_within_1_s'])} | 90 % |",
        *(
            f"| marred recordings, {words} | {_share(score['marred'][key])} | {target} |"
            for key, words, target in MARRED
        ),
        f"| nulls by the control runs that explain as much as their best candidate "
        f"| {_chance(score['chance'])} | each at most its share |",
        f"| seconds per case | median {score['seconds_median']:.1f}, "
        f"max {score['seconds_max']:.1f} | 20 |",
        f"| cases, failed runs | {score['cases']}, {score['failed']} | 0 failed |",
        "",
        "| can look-alikes be told apart? | cases | said `ambiguous` | with the truth listed |",
        "| --- | --- | --- | --- |",
    ]
    meaning = {
        "expected": "the data cannot tell",
        "allowed": "hard to tell",
        "no": "the data tell",
    }
    for kind, entry in score["ambiguous"].items():
        lines.append(
            f"| {meaning[kind]} | {entry['cases']} | {entry['said']} "
            f"| {entry['said_with_truth_listed']} |"
        )
    lines += [
        "",
        "| case | group | verdict | found | right | located | gap before | gap after | worst "
        "parameter (standard errors) | s |",
        "| --- | --- | --- | --- | --- | --- | --- | --- | --- | --- |",
    ]
    for row in rows:
        found = ", ".join([*row["found"], *row["terms"]]) or "nothing"
        z = [abs(p["z"]) for p in row["parameters"] if p["z"] is not None]
        mark = "exact" if row["exact"] else ("yes" if row["correct"] else "**no**")
        lines.append(
            f"| {row['case']} | {row['group']} | {row['verdict'].replace('|', '/')} | {found} "
            f"| {mark} | {_number(row['located'], '.0%')} | {_number(row['gap_before'])} "
            f"| {_number(row['gap_after'])}{_of_truth(row)} "
            f"| {_number(max(z) if z else None, '.2f')} "
            f"| {row['seconds']:.1f} |"
        )
    return "\n".join(lines) + "\n"


def score_cases(cases, binary, out, data=None, jobs=1, timeout=600.0):
    """Run and judge these cases; writes `score.md` and `score.json` in `out`, returns the score."""
    out = Path(out)
    data = Path(data) if data else out / "data"
    results = out / "results"
    for folder in (data, results):
        folder.mkdir(parents=True, exist_ok=True)
    rows = []
    with ThreadPoolExecutor(max_workers=jobs) as pool:
        for row in pool.map(lambda case: run_case(case, binary, data, results, timeout), cases):
            rows.append(row)
            mark = "exact" if row["exact"] else ("right" if row["correct"] else "WRONG")
            print(
                f"{row['case']:28s} {mark:6s} {row['verdict']:20s} {row['seconds']:.1f} s",
                flush=True,
            )
    score = summary(rows)
    (out / "score.json").write_text(json.dumps({"score": score, "cases": rows}, indent=1) + "\n")
    (out / "score.md").write_text(markdown(score, rows), encoding="utf-8")
    return score, rows
