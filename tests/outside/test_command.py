"""The real `cdpr` binary in a temporary folder."""

from __future__ import annotations

import csv
import json
import os
import stat
import subprocess
import xml.etree.ElementTree as ElementTree

import numpy as np
import pytest
from fmpy import simulate_fmu

from outside.fmu import INPUTS, OUTPUTS
from reference.parameters import Parameters

COMMANDS = (
    "demo",
    "fmu",
    "model",
    "simulate",
    "inverse",
    "analyse",
    "paper",
    "effects",
    "discover",
)
HEADER = "time," + ",".join(INPUTS)


def read_csv(path) -> dict[str, np.ndarray]:
    with open(path, newline="", encoding="utf-8") as file:
        rows = list(csv.reader(file))
    return {
        name: np.array([float(row[k]) for row in rows[1:]])
        for k, name in enumerate(rows[0])
        if not name.startswith("slack")
    }


def write_input(path, rows, header=HEADER):
    path.write_text(header + "\n" + "".join(",".join(map(str, row)) + "\n" for row in rows))
    return path


@pytest.fixture
def table(tmp_path):
    """An input table with jumps."""
    rows = [
        (0, 5000, 5100, 5200, 5300, 0, 0, 0),
        (0.5, 7000, 5100, 4200, 5300, 100, 0, 0),
        (1.2, 6000, 6100, 5200, 4300, 0, -200, 800),
    ]
    return write_input(tmp_path / "in.csv", rows)


# ---- help and exit codes


def existing_commands(cdpr) -> list[str]:
    text = cdpr("--help").stdout
    return [name for name in COMMANDS if f"  {name} " in text or f"  {name}\n" in text]


def test_help_of_the_command(cdpr):
    text = cdpr("--help").stdout
    assert "Usage" in text
    assert "Example" in text or "example" in text
    assert {"demo", "fmu", "simulate"} <= set(existing_commands(cdpr))


def test_help_of_every_subcommand_has_an_example(cdpr):
    for name in existing_commands(cdpr):
        done = cdpr(name, "--help")
        assert f"cdpr {name}" in done.stdout, name
        assert "xample" in done.stdout, name
        assert done.stderr == ""


def test_version(cdpr):
    assert cdpr("--version").stdout.startswith("cdpr ")


@pytest.mark.parametrize(
    "arguments",
    [
        (),
        ("nonsense",),
        ("simulate", "--no-such-option"),
        ("fmu",),
        ("simulate", "--stop", "soon", "-o", "out.csv"),
        ("simulate", "--stop", "-1", "-o", "out.csv"),
        ("simulate", "--step", "0", "-o", "out.csv"),
        ("simulate", "--step", "nan", "-o", "out.csv"),
    ],
    ids=" ".join,
)
def test_wrong_use_is_exit_code_2(cdpr, tmp_path, arguments):
    done = cdpr(*arguments, ok=False, cwd=tmp_path)
    assert done.returncode == 2
    assert done.stderr.strip()
    assert done.stdout == ""
    assert list(tmp_path.iterdir()) == []


# ---- model files


def refused(cdpr, tmp_path, text, command="fmu"):
    """What `cdpr` says to a model file it must not take."""
    (tmp_path / "model.toml").write_text(text)
    out = tmp_path / "out"
    done = cdpr(command, "--model", "model.toml", "-o", out, ok=False, cwd=tmp_path)
    assert done.returncode == 2, done.stderr
    assert not out.exists()
    assert "model.toml" in done.stderr
    assert "panicked" not in done.stderr
    return done.stderr


@pytest.mark.parametrize("command", ["fmu", "simulate"])
def test_broken_toml_names_the_line(cdpr, tmp_path, command):
    text = refused(cdpr, tmp_path, "platform_mass = 2500.0\nanchor_radius = = 3\n", command)
    assert "2" in text


@pytest.mark.parametrize(
    ("text", "words"),
    [
        ("platform_mass = -5.0\n", ["platform_mass", "-5"]),
        ("platform_mass = 0.0\n", ["platform_mass", "0"]),
        ("platform_mass = nan\n", ["platform_mass", "nan"]),
        ("platform_mass = 'heavy'\n", ["platform_mass"]),
        ("platform_mas = 5.0\n", ["platform_mas"]),
        ("anchor_angle = [0.0, 1.0, 2.0]\n", ["anchor_angle", "4"]),
        ("youngs_modulus = -1.0\n", ["youngs_modulus", "-1"]),
        ("cable_model = 'rubber'\n", ["cable_model", "rubber", "lumped_mass"]),
        ("[[effect]]\nid = 'no_such_effect'\n", ["no_such_effect"]),
        ("[[effect]]\nid = 'winch_lag'\ncable = 5\ntime_constant = 0.1\n", ["cable", "5"]),
        ("[[effect]]\nid = 'winch_lag'\ntime_constant = -0.1\n", ["time_constant", "-0.1"]),
        ("[[effect]]\nid = 'winch_lag'\n", ["time_constant"]),
        ("[[effect]]\nid = 'winch_lag'\ntime_constant = 0.1\nmass = 3.0\n", ["mass"]),
        ("[[effect]]\ntime_constant = 0.1\n", ["id"]),
    ],
)
def test_impossible_models_name_key_and_value(cdpr, tmp_path, text, words):
    said = refused(cdpr, tmp_path, text).lower()
    for word in words:
        assert word in said


def test_cables_through_the_platform(cdpr, tmp_path):
    """Attachments outside the anchors: no such robot."""
    said = refused(cdpr, tmp_path, "anchor_radius = 9.0\nattachment_radius = 10.0\n")
    assert "anchor_radius" in said or "attachment_radius" in said


def test_pose_outside_the_anchors(cdpr, tmp_path):
    done = cdpr("simulate", "--pose", "5000,0,0", "-o", "out.csv", ok=False, cwd=tmp_path)
    assert done.returncode == 2
    assert "5000" in done.stderr
    assert not (tmp_path / "out.csv").exists()


def test_missing_files(cdpr, tmp_path):
    for arguments in (
        ("fmu", "--model", "absent.toml", "-o", "a.fmu"),
        ("simulate", "--input", "absent.csv", "-o", "a.csv"),
    ):
        done = cdpr(*arguments, ok=False, cwd=tmp_path)
        assert done.returncode == 2
        assert arguments[2] in done.stderr
    assert list(tmp_path.iterdir()) == []


# ---- input tables


def refused_table(cdpr, tmp_path, text):
    (tmp_path / "in.csv").write_text(text)
    done = cdpr("simulate", "--input", "in.csv", "-o", "out.csv", ok=False, cwd=tmp_path)
    assert done.returncode == 2, done.stderr
    assert not (tmp_path / "out.csv").exists()
    assert "in.csv" in done.stderr
    return done.stderr


def test_a_missing_column_is_named(cdpr, tmp_path):
    header = HEADER.replace(",winch_force[3]", "")
    said = refused_table(cdpr, tmp_path, header + "\n0,1,1,1,0,0,0\n1,1,1,1,0,0,0\n")
    assert "winch_force[3]" in said
    said = refused_table(cdpr, tmp_path, HEADER.replace("time,", "") + "\n1,1,1,1,0,0,0\n")
    assert "time" in said


def test_time_that_goes_back_names_the_line(cdpr, tmp_path):
    rows = "0,1,1,1,1,0,0,0\n2,1,1,1,1,0,0,0\n1,1,1,1,1,0,0,0\n"
    said = refused_table(cdpr, tmp_path, HEADER + "\n" + rows)
    assert "4" in said
    assert "time" in said


@pytest.mark.parametrize(
    ("row", "words"),
    [
        ("1,a,1,1,1,0,0,0", ["winch_force[1]", "a", "3"]),
        ("1,nan,1,1,1,0,0,0", ["winch_force[1]", "3"]),
        ("1,inf,1,1,1,0,0,0", ["winch_force[1]", "3"]),
        ("1,1,1,1", ["3"]),
        (",1,1,1,1,0,0,0", ["time", "3"]),
    ],
)
def test_bad_cells_name_line_and_column(cdpr, tmp_path, row, words):
    said = refused_table(cdpr, tmp_path, f"{HEADER}\n0,1,1,1,1,0,0,0\n{row}\n")
    for word in words:
        assert word in said


@pytest.mark.parametrize("content", ["", HEADER + "\n", "\0\1\2"])
def test_empty_tables(cdpr, tmp_path, content):
    refused_table(cdpr, tmp_path, content)


def test_disturbances_may_be_left_out(cdpr, tmp_path):
    forces = [f"winch_force[{i}]" for i in range(1, 5)]
    write_input(tmp_path / "short.csv", [(0, 5e3, 5e3, 6e3, 5e3)], "time," + ",".join(forces))
    write_input(tmp_path / "long.csv", [(0, 5e3, 5e3, 6e3, 5e3, 0, 0, 0)])
    for name in ("short", "long"):
        cdpr("simulate", "--input", f"{name}.csv", "--stop", 1, "-o", f"{name}.out", cwd=tmp_path)
    assert (tmp_path / "short.out").read_bytes() == (tmp_path / "long.out").read_bytes()


# ---- output


def test_simulate_gives_what_fmpy_gives(cdpr, pack, table, tmp_path):
    parameters = Parameters(platform_mass=2222.0)
    (tmp_path / "model.toml").write_text(parameters.to_toml())
    cdpr(
        "simulate", "--model", "model.toml", "--input", table, "--stop", 2, "--step", 0.05,
        "-o", "out.csv", cwd=tmp_path,
    )  # fmt: skip
    ours = read_csv(tmp_path / "out.csv")
    assert ours["time"] == pytest.approx(np.arange(41) * 0.05, abs=1e-12)
    rows = read_csv(table)
    knots, lines = rows["time"], []
    for k, time in enumerate(knots):
        values = [rows[name] for name in INPUTS]
        if k:
            lines.append((time, *(v[k - 1] for v in values)))
        lines.append((time, *(v[k] for v in values)))
    signals = np.array(lines, dtype=[("time", float), *((name, float) for name in INPUTS)])
    theirs = simulate_fmu(
        str(pack(parameters).folder),
        stop_time=2.0,
        output_interval=0.05,
        input=signals,
        output=list(OUTPUTS),
    )
    for name in OUTPUTS:
        size = max(np.max(np.abs(theirs[name])), 1e-9)
        assert np.max(np.abs(ours[name] - theirs[name])) <= 1e-8 * size + 1e-12, name
    for name in INPUTS:
        assert name in ours, name


def test_output_of_simulate_is_an_input(cdpr, table, tmp_path):
    """A recorded run can be run again."""
    cdpr("simulate", "--input", table, "--stop", 2, "--step", 0.1, "-o", "a.csv", cwd=tmp_path)
    cdpr("simulate", "--input", "a.csv", "--stop", 2, "--step", 0.1, "-o", "b.csv", cwd=tmp_path)
    a, b = read_csv(tmp_path / "a.csv"), read_csv(tmp_path / "b.csv")
    for name in a:
        assert a[name] == pytest.approx(b[name], rel=1e-7, abs=1e-9), name


def test_picture_is_a_picture(cdpr, table, tmp_path):
    cdpr(
        "simulate",
        "--input",
        table,
        "--stop",
        2,
        "-o",
        "out.csv",
        "--plot",
        "out.svg",
        cwd=tmp_path,
    )
    root = ElementTree.parse(tmp_path / "out.svg").getroot()
    assert root.tag.endswith("svg")
    assert len(list(root.iter())) > 20


def test_output_is_whole_or_not_at_all(cdpr, tmp_path):
    """A failed run leaves an older result alone, and no half-written file beside it."""
    out = tmp_path / "out.csv"
    out.write_text("older result\n")
    rows = [(0, 5e3, 5e3, 5e3, 5e3, 0, 0, 0), (1, 1e9, 0, 0, 0, 0, 0, 0)]
    table = write_input(tmp_path / "in.csv", rows)
    done = cdpr("simulate", "--input", table, "--stop", 200, "-o", out, ok=False, cwd=tmp_path)
    assert done.returncode == 1, done.stderr
    assert out.read_text() == "older result\n"
    assert {p.name for p in tmp_path.iterdir()} == {"out.csv", "in.csv"}


@pytest.mark.skipif(os.name == "nt", reason="Windows has no unwritable folders of this kind")
def test_output_into_a_place_that_does_not_exist(cdpr, tmp_path):
    done = cdpr("simulate", "--stop", 1, "-o", tmp_path / "no" / "out.csv", ok=False)
    assert done.returncode in (1, 2)
    assert "out.csv" in done.stderr
    done = cdpr("fmu", "-o", tmp_path / "no" / "a.fmu", ok=False)
    assert done.returncode in (1, 2)
    assert "a.fmu" in done.stderr


@pytest.mark.skipif(os.name == "nt", reason="modes of files are POSIX's")
def test_output_files_can_be_read_by_others(cdpr, tmp_path):
    """Writing beside and renaming must not leave the private mode of a temporary file."""
    cdpr("fmu", "-o", "a.fmu", cwd=tmp_path)
    cdpr("simulate", "--stop", 1, "-o", "a.csv", cwd=tmp_path)
    (tmp_path / "plain").write_text("")
    expected = stat.S_IMODE((tmp_path / "plain").stat().st_mode)
    for name in ("a.fmu", "a.csv"):
        assert stat.S_IMODE((tmp_path / name).stat().st_mode) == expected, name


@pytest.mark.skipif(os.name == "nt", reason="POSIX pipes")
@pytest.mark.parametrize("arguments", [["--help"], ["effects"], ["effects", "--json"]])
def test_a_broken_pipe_is_quiet(cdpr, cdpr_bin, arguments):
    if arguments[0] == "effects":
        assert "effects" in existing_commands(cdpr)
    read, write = os.pipe()
    os.close(read)
    done = subprocess.run(
        [cdpr_bin, *arguments], stdout=write, stderr=subprocess.PIPE, timeout=30, check=False
    )
    os.close(write)
    assert done.stderr == b""
    assert done.returncode in (0, 141, -13)


def test_no_progress_bar_off_a_terminal(cdpr, tmp_path):
    done = cdpr("simulate", "--stop", 20, "-o", "out.csv", cwd=tmp_path)
    assert "\r" not in done.stderr
    assert "\x1b" not in done.stderr


def circle(path, radius, period):
    """A trajectory on a circle, turning to and fro."""
    times = np.arange(0.0, period + 0.25, 0.5)
    angle = 2.0 * np.pi * times / period
    columns = [times, radius * np.cos(angle), radius * np.sin(angle), 0.1 * np.sin(2.0 * angle)]
    rows = [",".join(f"{value:.9g}" for value in row) for row in zip(*columns, strict=True)]
    path.write_text("\n".join(["time,x,y,phi", *rows]) + "\n")
    return path


def test_inverse_keeps_winches_from_pushing_and_rounds_kinks(cdpr, tmp_path):
    """Least tensions have kinks, at which the elastic cables' inertia asks for jumps of force."""
    trajectory = circle(tmp_path / "circle.csv", 30.0, 30.0)

    def run(*options):
        forces = tmp_path / "forces.csv"
        call = ["inverse", "--trajectory", trajectory, "--step", "0.01", "--tension-min", "1"]
        done = cdpr(*call, "--objective", "minimum-norm", "-o", forces, *options)
        with forces.open() as file:
            rows = list(csv.DictReader(file))
        table = {
            name: np.array([[float(row[f"{name}[{i}]"]) for i in range(1, 5)] for row in rows])
            for name in ("winch_force", "tension")
        }
        return done.stderr, table

    said, kinked = run("--force-min", "-1e5")
    assert said == ""
    assert kinked["winch_force"].min() < -50.0
    assert kinked["tension"].min() == pytest.approx(1.0)
    # The tensions leave room for it.
    said, kept = run()
    assert said == ""
    assert kept["winch_force"].min() >= 0.0
    assert kept["tension"].min() > 1.0
    said, rounded = run("--smooth", "1000")
    assert said == ""
    assert rounded["winch_force"].min() > 0.0

    def inertia(table):
        return np.abs(table["winch_force"] - table["tension"]).max()

    assert inertia(rounded) < 0.5 * inertia(kinked)
    wrong = cdpr(
        *("inverse", "--trajectory", trajectory, "-o", tmp_path / "f.csv", "--smooth", "10"),
        ok=False,
    )
    assert wrong.returncode == 2
    assert "--objective minimum-norm" in wrong.stderr


def test_effects_say_which_speed_friction_sees(cdpr):
    """In a massless spring it is that of the geometric length, not the one that l' stands for."""
    entries = json.loads(cdpr("effects", "--json").stdout)
    for entry in entries:
        if entry["id"] in ("winch_coulomb_friction", "pulley_capstan_loss"):
            assert "massless_spring" in entry["speed"]
            assert "L\u0307" in entry["speed"]
    assert cdpr("effects").stdout.count("massless_spring") >= 4


def test_effects_lists_the_catalogue(cdpr):
    catalogue = json.loads(cdpr("effects", "--json").stdout)
    entries = catalogue if isinstance(catalogue, list) else catalogue["effects"]
    ids = {entry["id"] for entry in entries}
    assert {
        "platform_quadratic_drag",
        "winch_coulomb_friction",
        "winch_lag",
        "winch_delay",
        "platform_com_offset",
        "length_sensor_bias",
    } <= ids
    text = cdpr("effects").stdout
    for name in ids:
        assert name in text


def test_demo_tells_its_story(cdpr, tmp_path):
    done = cdpr("demo", "--out", tmp_path / "demo", timeout=300)
    out = tmp_path / "demo"
    assert (out / "CablePlatform.fmu").is_file()
    assert list(out.glob("*.csv"))
    assert list(out.glob("*.svg"))
    assert str(out) in done.stdout
