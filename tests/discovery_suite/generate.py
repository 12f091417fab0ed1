"""Write cases as folders of CSV files with their truth beside them."""

import json
import os
from concurrent.futures import ProcessPoolExecutor
from pathlib import Path

from . import moordyn_trial, trial
from .imperfections import sizes
from .parameters import OUTSIDE
from .strength import evidence, strength

# Where each effect may rightly be located. `{i}` is the cable; an effect on all cables may be found
# on any of them. A cable's law shows through its winch and the reverse, so both are accepted there.
_ON_CABLE = ("cable[{i}]", "winch[{i}]")
_ON_WINCH = ("winch[{i}]", "cable[{i}]")
_FORCES = ("platform.force_x", "platform.force_y")
_ALL_AXES = (*_FORCES, "platform.torque")
PLACES = {
    "cable_elasticity": _ON_CABLE,
    "cable_drag": (*_ON_CABLE, *_FORCES),
    "winch_lag": _ON_WINCH,
    "platform_mass": _FORCES,
    "platform_inertia": ("platform.torque",),
    "platform_com_offset": _ALL_AXES,
    "platform_linear_drag": _FORCES,
    "platform_quadratic_drag": _FORCES,
    "platform_rotational_damping": ("platform.torque",),
    "steady_wind": _ALL_AXES,
    "periodic_gust": _FORCES,
    "umbilical": _FORCES,
    "anchor_offset": _ON_CABLE,
    "attachment_offset": (*_ON_CABLE, "platform.torque"),
    "length_sensor_bias": ("sensor.{channel}[{i}]",),
    "length_sensor_scale": ("sensor.{channel}[{i}]",),
    "tension_sensor_gain": ("sensor.tension[{i}]",),
    "tension_sensor_bias": ("sensor.tension[{i}]",),
    "winch_drum_eccentricity": ("sensor.unstretched_length[{i}]",),
    "cable_wind": _ALL_AXES,
    "anchor_compliance": _ON_CABLE,
    "pulley_radius": _ON_CABLE,
    "pose_sensor_bias": ("sensor.x", "sensor.y", "sensor.phi"),
    "pose_sensor_delay": ("sensor.x", "sensor.y", "sensor.phi"),
    "pose_sensor_frame": ("sensor.x", "sensor.y", "sensor.phi"),
    "pose_sensor_scale": ("sensor.x", "sensor.y"),
}


def places(effect, all_cables):
    """The `where` strings under which finding this effect counts as located."""
    if effect["id"] == "outside":
        targets = OUTSIDE[effect["law"]][2]
        return [t.replace("[cable]", f"[{effect['cable']}]") for t in targets]
    default = _ON_CABLE if effect["id"].startswith("cable") else _ON_WINCH
    patterns = PLACES.get(effect["id"], default)
    cables = range(1, all_cables + 1) if effect["cable"] is None else [effect["cable"]]
    channel = effect.get("channel", "unstretched_length")
    return sorted({p.format(i=i, channel=channel) for p in patterns for i in cables})


def truth(case, strengths, noise):
    """What is hidden in a case, and what a good answer looks like."""
    effects, terms, cables = [], [], case.holdout.robot.cables
    for item in case.effects:
        if item["id"] == "outside":
            _, _, _targets, expression = OUTSIDE[item["law"]]
            terms.append(
                {
                    "targets": places(item, cables),
                    "expression": expression,
                    "values": item["parameters"],
                }
            )
        else:
            effects.append(dict(item, located=places(item, cables)))
    return {
        "case": case.name,
        "group": case.group,
        "model": case.model,
        "cables": cables,
        "effects": effects,
        "terms": terms,
        "ambiguous": case.ambiguous,
        "alternatives": list(case.alternatives),
        "acceptable": list(case.acceptable),
        "survey": list(case.survey),
        "imperfections": sizes(case.holdout.imperfections),
        "strength": strengths,
        "noise": noise,
        "note": case.note,
    }


def run_trial(case, settings):
    """One trial of a case, on this package's plant or on MoorDyn's cables."""
    if case.group == "moordyn":
        return moordyn_trial.run(settings)
    return trial.run(settings, (*case.effects, *case.survey), case.data_model)


def write_case(case, folder):
    """Run the trials of one case and write its folder; returns its name and strengths."""
    folder = Path(folder) / case.name
    folder.mkdir(parents=True, exist_ok=True)
    strengths, noise = {}, {}
    files = [(f"train{i + 1}", s) for i, s in enumerate(case.train)] + [("holdout", case.holdout)]
    for name, settings in files:
        record = run_trial(case, settings)
        trial.write_csv(record, folder / f"{name}.csv")
        noise[name] = record.noise
        if case.group != "null":
            strengths[name] = strength(record, case.model)
    (folder / "model.toml").write_text(case.toml(), encoding="utf-8")
    text = json.dumps(truth(case, strengths, noise), indent=1)
    (folder / "truth.json").write_text(text + "\n", encoding="utf-8")
    return case.name, strengths


def measure_case(case):
    """Chi-square of no effect and of each rival on the first training trial (see `strength`)."""
    record = run_trial(case, case.train[0])
    found = {"none": evidence(record)}
    for rival, free in case.rivals:
        found[rival["id"]] = evidence(record, rival, free)
    return case.name, found


def each_case(function, cases, jobs=None):
    """Run `function` on these cases in `jobs` processes (all cores unless told), and print."""
    with ProcessPoolExecutor(max_workers=jobs or os.cpu_count() or 1) as pool:
        for name, numbers in pool.map(function, cases):
            shown = "  ".join(f"{key} {value:.3g}" for key, value in numbers.items())
            print(f"{name:28s} {shown}", flush=True)
