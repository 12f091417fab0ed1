"""`cdpr discover` on recordings made by the independent generator of `discovery_suite`."""

from __future__ import annotations

import csv
import json
import os
import re
import shutil
import subprocess
import sys
from collections import defaultdict
from itertools import pairwise

import numpy as np
import pytest

from discovery_suite import trial
from discovery_suite.cases import effect
from outside.fmu import Fmu, indexed

FORCE, SPEED = 180.0, 0.02
FRICTION = effect("winch_coulomb_friction", 3, law="tanh", force=FORCE, transition_speed=SPEED)
SETTINGS = trial.Settings(seed=11, duration=60.0, rate=25.0, lead_in=12.0)
FILES = ("report.html", "discovery.json", "model.toml", "CablePlatform.fmu", "gap.csv")
RATES = {"x": "vx", "y": "vy", "phi": "omega"} | dict(
    zip(indexed("unstretched_length"), indexed("unstretched_length_rate"), strict=True)
)


def record(path, effects=(), **changes):
    """Write one recording."""
    trial.write_csv(trial.run(SETTINGS.but(**changes), effects), path)
    return path


@pytest.fixture(scope="module")
def friction(cdpr, tmp_path_factory):
    """A recording with friction on winch 3, searched: the folder and what was printed."""
    folder = tmp_path_factory.mktemp("friction")
    record(folder / "run.csv", [FRICTION])
    record(folder / "check.csv", [FRICTION], seed=12, duration=40.0)
    done = cdpr(
        *("discover", "--data", "run.csv", "--holdout", "check.csv", "--out", "found"),
        cwd=folder,
        timeout=280,
    )
    return folder / "found", done


@pytest.fixture(scope="module")
def nothing_hidden(tmp_path_factory):
    """A recording of a robot that is as the model says."""
    return record(tmp_path_factory.mktemp("nothing") / "run.csv", seed=13)


def result(folder):
    return json.loads((folder / "discovery.json").read_text(encoding="utf-8"))


# ---- what it finds and writes


def test_a_search_that_runs_out_of_time_says_so_and_writes_what_it_has(cdpr, friction):
    folder = friction[0].parent
    hurried = folder / "hurried"
    arguments = ("--data", folder / "run.csv", "--out", hurried)
    done = cdpr("discover", *arguments, "--time-limit", "1e-6")
    assert "ran out of time" in done.stdout
    found = result(hurried)
    assert (found["ended_early"], found["verdict"], found["effects"]) == (True, "unnamed", [])
    assert found["detection_limits"]
    assert any("--time-limit" in remark for remark in found["remarks"])
    assert all((hurried / name).is_file() for name in FILES)
    wrong = cdpr("discover", *arguments, "--time-limit", "0", ok=False)
    assert wrong.returncode == 2
    assert "0 is not greater than 0" in wrong.stderr


def test_the_hidden_effect_is_named(friction):
    folder, done = friction
    found = result(folder)
    assert found["schema"] == 1
    assert found["verdict"] in ("named", "ambiguous")
    [one] = found["effects"]
    named = [(one["id"], one["cable"])]
    named += [(other["id"], other["cable"]) for other in one["indistinguishable_from"]]
    assert ("winch_coulomb_friction", 3) in named
    assert all(other["separate_by"] for other in one["indistinguishable_from"])
    if one["id"] == "winch_coulomb_friction":
        force = one["parameters"]["force"]
        assert force["unit"] == "N"
        assert abs(force["value"] - FORCE) < 4.0 * force["standard_error"]
    assert one["delta_bic"] < -10.0
    assert found["located"][0]["where"] == "winch[3]"
    for start, end in found["located"][0]["when"]:
        assert 0.0 <= start < end <= SETTINGS.duration
    assert found["terms"] == []
    assert "winch 3" in done.stdout.splitlines()[0]


def test_the_gap_shrinks_to_the_noise_on_held_out_data(friction):
    folder, _ = friction
    gap = result(folder)["gap"]
    assert gap["horizon_s"] == 5.0
    for part in (gap["train"], gap["holdout"], *gap["channels"].values()):
        assert part["before"] > 5.0
        assert part["after"] < 1.2
    assert set(gap["channels"]) == set(RATES)
    assert [h["horizon_s"] for h in gap["horizons"]] == [1.0, 5.0, 20.0]


def test_every_file_is_there_whole_and_told(friction):
    folder, done = friction
    assert sorted(path.name for path in folder.iterdir()) == sorted(FILES)
    for name in FILES:
        assert f"found/{name}" in done.stdout.replace("\\", "/")
    told = done.stderr.splitlines()
    assert all(re.fullmatch(r".+: \d+ %, \d+ s so far", line) for line in told), "no bar in a log"
    page = (folder / "report.html").read_text(encoding="utf-8")
    assert page.rstrip().endswith("</html>")
    assert "winch\u00a03" in page


def test_the_model_found_can_be_packed_again(friction, cdpr, tmp_path):
    folder, _ = friction
    cdpr("fmu", "--model", folder / "model.toml", "-o", tmp_path / "again.fmu")
    again, written = tmp_path / "again.fmu", folder / "CablePlatform.fmu"
    assert again.read_bytes() == written.read_bytes()


# ---- the same improvement through FMI, by another importer


def held_out(folder):
    """Time, measured, before, after and the restarts of the held-out recording in `gap.csv`."""
    columns = defaultdict(lambda: defaultdict(list))
    with open(folder / "gap.csv", newline="", encoding="utf-8") as file:
        for row in csv.DictReader(file):
            if row["trial"] == "check.csv":
                for key in ("time", "restart", "measured", "before", "after"):
                    columns[row["channel"]][key].append(float(row[key] or "nan"))
    return {name: {k: np.array(v) for k, v in column.items()} for name, column in columns.items()}


def forces(path):
    with open(path, newline="", encoding="utf-8") as file:
        rows = list(csv.DictReader(file))
    return np.array([[float(row[name]) for name in indexed("winch_force")] for row in rows])


def replay(fmu, table, commands, side, noise):
    """The gap over 5 s: the FMU starts where the search's own simulation restarted."""
    time = table["x"]["time"]
    restarts = [*np.flatnonzero(table["x"]["restart"]), len(time)]
    channels = list(RATES)
    squares = []
    for start, end in pairwise(restarts):
        if end - start < 4:
            continue
        step = time[start + 1] - time[start]
        values = {"initialization": fmu.enumeration("initialization", "from_states")}
        for name, rate in RATES.items():
            f = table[name][side][start : start + 4]
            values[name] = f[0]
            values[rate] = (-11.0 * f[0] + 18.0 * f[1] - 9.0 * f[2] + 2.0 * f[3]) / (6.0 * step)
        values |= dict(zip(indexed("winch_force"), commands[start], strict=True))
        with fmu.instance(values=values) as slave:
            for k in range(start, end - 1):
                slave.set(dict(zip(indexed("winch_force"), commands[k], strict=True)))
                slave.step(time[k + 1] - time[k])
                shown = slave.get(channels)
                measured = [table[name]["measured"][k + 1] for name in channels]
                squares.append((np.subtract(shown, measured) / noise) ** 2)
    return float(np.sqrt(np.nanmean(squares)))


def test_the_fmu_reproduces_the_improvement(friction, fmu, tmp_path):
    folder, _ = friction
    found = result(folder)
    noise = np.array([found["channels"][name]["noise"] for name in RATES])
    table, commands = held_out(folder), forces(folder.parent / "check.csv")
    new = Fmu.unpack(folder / "CablePlatform.fmu", tmp_path / "new")
    before = replay(fmu, table, commands, "before", noise)
    after = replay(new, table, commands, "after", noise)
    gap = found["gap"]["holdout"]
    assert before == pytest.approx(gap["before"], rel=0.02)
    assert after == pytest.approx(gap["after"], rel=0.05)


# ---- honesty, repeatability, other people's tables


@pytest.fixture(scope="module")
def nothing_found(cdpr, nothing_hidden, tmp_path_factory):
    folder = tmp_path_factory.mktemp("honest")
    done = cdpr("discover", "--data", nothing_hidden, "--out", folder, timeout=280)
    return result(folder), done.stdout


def test_nothing_is_found_where_nothing_is_hidden(nothing_found):
    found, said = nothing_found
    assert found["verdict"] == "no_missing_effect"
    assert (found["effects"], found["terms"], found["located"]) == ([], [], [])
    gap = found["gap"]["holdout"]
    assert gap["before"] == gap["after"] < 1.2
    assert "the last" in found["gap"]["holdout_source"], "with one recording a part is held out"
    assert said.startswith("Nothing is missing")


def test_the_same_call_finds_the_same(cdpr, nothing_hidden, nothing_found, tmp_path):
    cdpr("discover", "--data", nothing_hidden, "--out", tmp_path, timeout=280)
    again, first = result(tmp_path), nothing_found[0]
    for found in (again, first):
        found["search"].pop("seconds", None)
    assert again == first


def test_a_map_renames_columns_and_converts_units(cdpr, nothing_hidden, nothing_found, tmp_path):
    with open(nothing_hidden, newline="", encoding="utf-8") as file:
        rows = list(csv.DictReader(file))
    for row in rows:
        row["t_ms"] = f"{1e3 * float(row.pop('time')):.6f}"
        row["F1"] = f"{1e-3 * float(row.pop('winch_force[1]')):.9f}"
        row["px"] = row.pop("x")
        row["tilt"] = f"{1e3 * float(row.pop('phi')):.9f}" if row["phi"] else row.pop("phi")
    with open(tmp_path / "theirs.csv", "w", newline="", encoding="utf-8") as file:
        writer = csv.DictWriter(file, list(rows[0]))
        writer.writeheader()
        writer.writerows(rows)
    (tmp_path / "map.toml").write_text(
        'time = { column = "t_ms", unit = "ms" }\n'
        '"winch_force[1]" = { column = "F1", unit = "kN" }\n'
        'x = "px"\n'
        'phi = { column = "tilt", unit = "mrad" }\n'
    )
    arguments = ["discover", "--data", "theirs.csv", "--map", "map.toml", "--out", "found"]
    cdpr(*arguments, cwd=tmp_path, timeout=280)
    mapped, plain = result(tmp_path / "found"), nothing_found[0]
    assert mapped["verdict"] == plain["verdict"]
    assert mapped["gap"]["holdout"]["after"] == pytest.approx(
        plain["gap"]["holdout"]["after"], rel=1e-6
    )


# ---- bad input


def broken(text, how):
    """The table with one thing wrong with it."""
    header, *body = [line.split(",") for line in text.splitlines()]
    gone = {
        "no winch force": ("winch_force[2]",),
        "pose unobservable": ("y", "phi", *indexed("unstretched_length")),
    }
    keep = [k for k, name in enumerate(header) if name not in gone.get(how, ())]
    match how:
        case "time goes back":
            body[40][0] = body[20][0]
        case "no number":
            body[40][header.index("x")] = "nothing"
        case "input missing":
            body[40][header.index("winch_force[1]")] = ""
        case "too short":
            del body[30:]
    lines = [",".join(row[k] for k in keep) for row in (header, *body)]
    if how == "ragged":
        lines[41] += ",7"
    return "\n".join(lines) + "\n"


@pytest.mark.parametrize(
    ("how", "words"),
    [
        ("no winch force", ("line 1", "winch_force[2]")),
        ("pose unobservable", ("pose", "found 1 of x, y, phi", "expected")),
        ("time goes back", ("line 42", "time", "expected more than")),
        ("no number", ("line 42", "`x`", "nothing", "expected a number")),
        ("input missing", ("line 42", "`winch_force[1]`", "expected a number")),
        ("too short", ("30 samples", "expected 50")),
        ("ragged", ("line 42",)),
    ],
)
def test_bad_recordings_are_refused_by_place(cdpr, nothing_hidden, tmp_path, how, words):
    text = nothing_hidden.read_text(encoding="utf-8")
    (tmp_path / "bad.csv").write_text(broken(text, how), encoding="utf-8")
    done = cdpr("discover", "--data", "bad.csv", "--out", "found", ok=False, cwd=tmp_path)
    assert done.returncode == 2
    for word in ("bad.csv", *words):
        assert word in done.stderr, done.stderr
    assert not (tmp_path / "found").exists()
    assert done.stdout == ""


@pytest.mark.parametrize(
    ("text", "words"),
    [
        ('x = "pos"\n', ("line 1", "`pos`", "`x`")),
        ('vx = "x"\n', ("map.toml", "`vx`", "expected one of time, winch_force[1]")),
        ('x = { column = "x", unit = "furlong" }\n', ("map.toml", "`x`", '"furlong"', "mm")),
        ("x = \n", ("map.toml, line 1",)),
    ],
)
def test_bad_maps_are_refused_by_key(cdpr, nothing_hidden, tmp_path, text, words):
    (tmp_path / "map.toml").write_text(text)
    arguments = ["discover", "--data", nothing_hidden, "--map", "map.toml", "--out", "found"]
    done = cdpr(*arguments, ok=False, cwd=tmp_path)
    assert done.returncode == 2
    for word in words:
        assert word in done.stderr, done.stderr


def test_wrong_use_is_told(cdpr, nothing_hidden, tmp_path):
    for arguments, word in [
        (["--out", "found"], "--data"),
        (["--data", nothing_hidden], "--out"),
        (["--data", "none.csv", "--out", "found"], "none.csv"),
        (["--data", nothing_hidden, "--model", "none.toml", "--out", "found"], "none.toml"),
        (["--data", nothing_hidden, "--out", nothing_hidden], "folder"),
    ]:
        done = cdpr("discover", *arguments, ok=False, cwd=tmp_path)
        assert (done.returncode, word in done.stderr) == (2, True), done.stderr


@pytest.mark.skipif(sys.platform != "linux", reason="mounts a file system as Linux does")
def test_a_temporary_folder_mounted_noexec_is_named_before_the_search(
    cdpr_bin, nothing_hidden, tmp_path
):
    folder = tmp_path / "noexec"
    folder.mkdir()
    alone = ["unshare", "--mount"] + (["--user", "--map-root-user"] if os.geteuid() else [])
    mounted = [*alone, "sh", "-c", 'mount -t tmpfs -o noexec tmpfs "$TMPDIR" && exec "$@"', "sh"]

    def run(*command):
        environment = os.environ | {"TMPDIR": str(folder)}
        done = [*mounted, *map(str, command)]
        return subprocess.run(done, capture_output=True, text=True, cwd=tmp_path, env=environment)

    if shutil.which("unshare") is None or run("true").returncode:
        pytest.skip("NOT TESTED: a folder mounted noexec; mounting one is not allowed here")
    done = run(cdpr_bin, "discover", "--data", nothing_hidden, "--out", "found")
    assert done.returncode == 2, done.stderr
    for word in (str(folder), "noexec", "TMPDIR names another"):
        assert word in done.stderr, done.stderr
    # Before the search: nothing was begun and nothing is left.
    assert done.stdout == ""
    assert [path.name for path in tmp_path.iterdir()] == ["noexec"]
