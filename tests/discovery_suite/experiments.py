"""Planned experiments: `cdpr discover`, `cdpr experiment` on what it leaves open, `discover` again.

The first recordings of a case leave two or more laws open. The plan is driven on this package's
plant, once with each of these laws as the truth, at the size that it was found with; each of these
new recordings must bring out its own.
"""

import json
import subprocess
from dataclasses import dataclass, replace
from pathlib import Path

from .cases import Case, case, effect, seed, single_trial
from .cases_hard import LOOK_ALIKES, NEAR_THRESHOLD
from .generate import write_case


@dataclass(frozen=True)
class Experiment:
    """A case whose first recordings leave something open, and limits of the next experiment."""

    case: Case
    limits: dict


def limits_toml(limits):
    """The text of `limits.toml`."""
    return "".join(f"{name} = {value}\n" for name, value in limits.items())


def law_of(entry):
    """An effect of `discovery.json` as one of this package."""
    values = {name: size["value"] for name, size in entry["parameters"].items()}
    extra = {}
    if "channel" in entry:
        extra["channel"] = entry["channel"]
    if entry["id"] == "pulley_capstan_loss":
        extra["smoothing_speed"] = values["transition_speed"]
    return effect(entry["id"], entry["cable"], compare=(), extra=extra, **values)


def _run(command, timeout):
    done = subprocess.run(command, capture_output=True, text=True, timeout=timeout, check=False)
    return done.returncode, done.stdout, done.stderr.strip()


def _discover(binary, folder, out, timeout):
    data = sorted(str(path) for path in folder.glob("train*.csv"))
    command = [str(binary), "discover", "--data", *data, "--holdout", str(folder / "holdout.csv")]
    command += ["--model", str(folder / "model.toml"), "--out", str(out)]
    code, _, error = _run(command, timeout)
    if code != 0:
        raise RuntimeError(f"{folder}: cdpr discover gave {code}, {error}")
    return json.loads((out / "discovery.json").read_text(encoding="utf-8"))


def name_of(entry):
    """Id and cable in one word."""
    return entry["id"] + (f"[{entry['cable']}]" if entry["cable"] else "")


def _open(answer):
    """The first effect with rivals that are as good: itself and these."""
    for entry in answer["effects"]:
        if entry["indistinguishable_from"]:
            return [entry, *entry["indistinguishable_from"]]
    return []


def again(experiment, law, rivals, plan, binary, folder, timeout):
    """Drive the plan twice with `law` as the truth and discover: what was said, whether right.

    It is right where the law is found, and none of its `rivals`, which the plan is for, is left
    open. The whole catalogue is looked at again: a law that was no rival before may be one now.
    """
    first = experiment.case.train[0]
    name = f"{experiment.case.name}_{name_of(law)}"
    settings = first.but(
        plan=str(plan),
        duration=experiment.limits["duration"],
        rate=1.0 / experiment.limits["interval"],
        lead_in=12.0,
        seed=seed(name, 1),
    )
    made = replace(
        experiment.case,
        name=name,
        effects=(law_of(law),),
        train=(settings,),
        holdout=settings.but(seed=seed(name, 2)),
    )
    write_case(made, folder)
    answer = _discover(binary, folder / name, folder / name / "found", timeout)
    found = [name_of(entry) for entry in answer["effects"]]
    still = [name_of(entry) for entry in _open(answer)[1:]]
    named = answer["verdict"] in ("named", "ambiguous") and found == [name_of(law)]
    right = named and not set(still) & {name_of(rival) for rival in rivals}
    return {"found": found, "verdict": answer["verdict"], "still": still, "right": right}


def run(experiment, binary, folder, timeout=600.0):
    """One experiment from the first recordings to the last answers: a dictionary for the table."""
    folder = Path(folder)
    name = experiment.case.name
    write_case(experiment.case, folder)
    out = folder / name / "found"
    before = _discover(binary, folder / name, out, timeout)
    row = {"case": name, "before": before["verdict"], "open": [name_of(e) for e in _open(before)]}
    if before["verdict"] != "ambiguous":
        return row
    limits, plan = folder / name / "limits.toml", folder / name / "plan.csv"
    limits.write_text(limits_toml(experiment.limits), encoding="utf-8")
    command = [str(binary), "experiment", "--from", str(out / "discovery.json")]
    command += ["--limits", str(limits), "-o", str(plan)]
    code, text, error = _run(command, timeout)
    row |= {"exit_code": code, "plan": text or error}
    if code != 0:
        return row
    row["after"] = {}
    laws = _open(before)
    for law in laws:
        rivals = [rival for rival in laws if rival is not law]
        row["after"][name_of(law)] = again(experiment, law, rivals, plan, binary, folder, timeout)
    return row


_NEAR = {
    "x": [-20.0, 20.0],
    "y": [-20.0, 20.0],
    "phi": [-0.1, 0.1],
    "speed": 1.5,
    "angular_speed": 0.03,
    "tension": [3e3, 45e3],
    "duration": 100.0,
    "interval": 0.02,
}
# A scale and a bias of a length of 900 m differ where it changes by hundreds of metres.
_FAR = {**_NEAR, "x": [-250.0, 250.0], "y": [-250.0, 250.0], "speed": 8.0, "duration": 200.0}

_KNOWN = {made.name: made for made in [*LOOK_ALIKES, *NEAR_THRESHOLD]}


def _short(name, hidden, **changes):
    """A short recording of a slow motion at one pretension."""
    return case(name, "experiment", [hidden], trials=single_trial, duration=40.0, **changes)


EXPERIMENTS = [
    Experiment(_KNOWN["alike_lag_delay"], {**_NEAR, "fastest": 0.5}),
    Experiment(_KNOWN["alike_length_scale_bias"], _FAR),
    Experiment(_KNOWN["near_gain"], {**_NEAR, "interval": 0.05}),
    Experiment(_KNOWN["near_linear_drag"], {**_NEAR, "interval": 0.05}),
    Experiment(
        _short(
            "open_coulomb_capstan",
            effect("winch_coulomb_friction", 3, law="tanh", force=6.0, transition_speed=0.02),
        ),
        _NEAR,
    ),
    Experiment(_short("open_gain_bias", effect("winch_force_gain", 1, factor=2e-4)), _NEAR),
    Experiment(
        _short(
            "open_viscous_drag", effect("winch_viscous_friction", coefficient=0.6), rotation=0.005
        ),
        _NEAR,
    ),
]


def _in_words(told):
    still = f", {', '.join(told['still'])} left open" if told["still"] else ""
    found = "right" if told["right"] else f"{told['verdict']} {', '.join(told['found'])}"
    return found + still


def markdown(rows):
    """The table of `docs/experiment.md`."""
    lines = ["| open before | with each as the truth, after |", "| --- | --- |"]
    for row in rows:
        after = "; ".join(f"{law}: {_in_words(it)}" for law, it in row.get("after", {}).items())
        lines.append(f"| {row['case']}: {', '.join(row['open'])} | {after or row['before']} |")
    return "\n".join(lines) + "\n"
