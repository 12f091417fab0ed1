"""The readers of public recordings: on files of their form, and on the recordings themselves."""

import json
import os
import re
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest
from scipy.io import savemat

from outside.test_examples import EXAMPLES, load

READER = EXAMPLES / "real" / "cable_robot.py"
DRIVE = EXAMPLES / "real" / "emps.py"
CAPTURE = EXAMPLES / "real" / "motion_capture.py"
PERIOD = 0.05


def motion(rows):
    """Lengths (m) and their rates (m/s) of a point on four cables, by its own formula."""
    corners = np.array([(2.95, 0.0), (2.95, 2.3), (0.0, 2.3), (0.0, 0.0)])
    time = PERIOD * np.arange(rows)
    x = np.array([1.5 + 0.6 * np.sin(0.4 * time), 1.1 + 0.5 * np.cos(0.7 * time)]).T
    v = np.array([0.24 * np.cos(0.4 * time), -0.35 * np.sin(0.7 * time)]).T
    apart = x[:, None] - corners
    length = np.linalg.norm(apart, axis=2)
    return length, np.einsum("tij,tj->ti", apart, v) / length


def write_log(path, lead=30, rows=600, steps=4):
    """A log of this form: `lead` rows with the motors off, then `rows` with them on, `steps` lines
    of the controller after each."""
    length, rate = motion(rows)
    lines = ["5.75, 15.75, 15.75"]  # the end of a line that began before the log
    for row in range(-lead, rows):
        at = max(row, 0)
        speeds = -rate[at] / (2 * np.pi * 0.0127) if row >= 0 else np.zeros(4)
        torques = [0.2, 0.3 + 0.1 * (row % 2), 0.2, 0.25] if row >= 0 else [0.0] * 4
        cells = ["0"] * 4 + ["8"] * 4
        cells += [f"{-v:.2f}" for v in length[at]] + [f" {v:.2f}" for v in speeds]
        cells += [f"{v:.2f}" for v in torques] + ["1.50", "1.10", "0.00"]
        lines.append(",".join(cells[:8]) + "," + ", ".join(cells[8:]))
        if row >= 0:
            for step in range(steps):
                asked = f"{15.0 + step:.2f}, 20.00, 15.75, 15.75"
                lines.append(f"Traj: {at}\t1.5, 1.1, 1.5, 1.1, 0.0, 0.0\t1.0, -2.0\t{asked}")
    lines.insert(50, "Tried to send nan: 3 - 14")
    path.write_text("\n".join(lines) + "\n", encoding="utf-8")
    return path


def test_a_log_is_read_with_signs_units_and_time(tmp_path):
    reader = load(READER)
    log = reader.read_log(write_log(tmp_path / "a_Feb01.txt"))
    begin, end = reader.longest_run(log)
    assert (begin, end) == (30, 630)
    run = log.part(begin, end)
    length, rate = motion(600)
    assert np.abs(run.length - length).max() < 0.0051
    assert np.abs(run.speed - rate).max() < 0.0005
    assert reader.period(run) == pytest.approx(PERIOD, rel=0.01)


def test_forces_are_the_mean_until_the_next_row(tmp_path):
    reader = load(READER)
    log = reader.read_log(write_log(tmp_path / "a_Feb01.txt"))
    assert reader.forces(log)[100] == pytest.approx([16.5, 20.0, 15.75, 15.75])
    without = reader.read_log(write_log(tmp_path / "a_Mar01.txt", steps=0))
    assert reader.forces(without)[100] == pytest.approx(np.array([0.2, 0.35, 0.2, 0.25]) / 0.0127)


def test_what_is_no_log_is_refused_with_its_name(tmp_path):
    (tmp_path / "other_Feb01.txt").write_text("time,x\n0,1\n", encoding="utf-8")
    write_log(tmp_path / "undated.txt")
    write_log(tmp_path / "short_Feb01.txt", rows=100)
    for name, part in [
        ("other_Feb01.txt", "no row of a log"),
        ("undated.txt", "by a month in the name, one of Feb, Mar"),
        ("short_Feb01.txt", "driven for 100 rows, expected 200 or more"),
        ("missing_Feb01.txt", "No such file"),
    ]:
        done = run_reader(tmp_path / name, out=tmp_path / "out")
        assert done.returncode != 0
        assert name in done.stderr
        assert part in done.stderr, done.stderr


def run_reader(*files, out, reader=READER):
    return subprocess.run(
        [sys.executable, reader, *files, "--out", out],
        capture_output=True,
        text=True,
        timeout=60,
        check=False,
    )


def calibrated(cdpr, folder, name):
    """Calibrates what the reader made of a log; returns the misfits (mm) before and after."""
    shown = cdpr(
        *("calibrate", "--data", f"{name}.csv", "--model", f"{name}.toml"),
        *("-o", f"{name}-calibrated.toml"),
        cwd=folder,
        timeout=280,
    ).stdout
    rows = re.findall(r"^cable_length\[\d\] +(\S+) +(\S+) +\d+$", shown, re.MULTILINE)
    return np.array(rows, dtype=float)


@pytest.mark.slow
def test_a_recording_made_by_the_reader_is_calibrated_by_its_lengths(cdpr, tmp_path):
    """Anchors of another frame, which the lengths alone tell, to what their rounding leaves."""
    done = run_reader(write_log(tmp_path / "a_Mar01.txt", steps=0), out=tmp_path)
    assert done.returncode == 0, done.stderr
    before, after = calibrated(cdpr, tmp_path, "a_Mar01").T
    assert before.max() > 20.0
    assert after.max() < 3.0


def write_capture(folder, ahead=1.5):
    """A take and a log of this form, the take's clock ahead by so much (s)."""
    names, kinds, axes = [["", ""] for _ in range(3)]
    axes[:] = ["Frame", "Time"]
    time = np.arange(3600) / 120

    def pose(t):
        wander = 0.5 * np.sin(0.31 * t) * np.sin(0.7 * t), 0.4 * np.cos(0.43 * t)
        return np.array([*wander, 0.1 * np.sin(0.5 * t)])

    x, y, phi = pose(time)
    half = phi / 2
    turned = [-np.sin(half), 0 * half, 0 * half, np.cos(half)]
    table = [np.arange(len(time)), time, *turned, 0 * x - 0.1, y + 1.2, x]
    for kind, wanted in [("Rotation", "XYZW"), ("Position", "XYZ")]:
        names += ["Rigid Body 2"] * len(wanted)
        kinds += [kind] * len(wanted)
        axes += wanted
    corners = [(1.45, 0.0), (1.45, 2.4), (-1.45, 2.4), (-1.45, 0.0)]
    for number, (z, up) in enumerate(corners):
        names += [f"Marker_{number}"] * 3
        kinds += ["Position"] * 3
        axes += "XYZ"
        table += [0 * x - 0.1, 0 * x + up, 0 * x + z]
    # Bodies and markers, their names, their marks, kinds and axes.
    lines = ["Format Version,1.1", ""]
    lines += [",".join(cells) for cells in (kinds, names, names, kinds, axes)]
    lines += [",".join(f"{v:.7f}" for v in row) for row in np.array(table).T]
    (folder / "take.csv").write_text("\n".join(lines) + "\n", encoding="utf-8")
    rows = []
    for t in 0.01 * np.arange(2600):
        x, y, phi = pose(t + ahead)
        arms = np.array([(1, -1), (1, 1), (-1, 1), (-1, -1)]) * (0.09175, 0.06)
        ends = np.array([x, y]) + arms @ np.array(
            [[np.cos(phi), np.sin(phi)], [-np.sin(phi), np.cos(phi)]]
        )
        lengths = np.linalg.norm(np.array(corners) - (0, 1.2) - ends, axis=1)
        cells = "".join(f"\t|\t0 8 {-length:.4f} 0.0000" for length in lengths)
        rows.append(f"3: {x:.4f} {y:.4f} - {x:.4f} {y:.4f}{cells}\t|\t1")
    (folder / "log.txt").write_text("\n".join(rows) + "\n", encoding="utf-8")


@pytest.mark.slow
def test_motion_capture_and_lengths_are_one_recording(cdpr, tmp_path):
    write_capture(tmp_path)
    done = run_reader(tmp_path / "take.csv", tmp_path / "log.txt", out=tmp_path, reader=CAPTURE)
    assert done.returncode == 0, done.stderr
    assert "clock 1.50 s ahead" in done.stdout
    before, after = calibrated(cdpr, tmp_path, "take").T
    # Lengths are written to 0.1 mm, and the middle turn is not quite zero.
    assert before.max() < 1.0
    assert after.max() < 0.1
    (tmp_path / "log.txt").write_text("no log\n", encoding="utf-8")
    done = run_reader(tmp_path / "take.csv", tmp_path / "log.txt", out=tmp_path, reader=CAPTURE)
    assert done.returncode != 0
    assert "log.txt: no row of a log" in done.stderr


LOGS = ("iros_logo_take3_Feb19", "Feb22_iros_logo_1", "Mar2_iros_logo_1")


@pytest.fixture(scope="module")
def logs():
    """The folder of the logs in a clone of gchenfc/cable-robot."""
    folder = os.environ.get("CDPR_CABLE_ROBOT")
    if not folder:
        pytest.skip("CDPR_CABLE_ROBOT does not name a clone of gchenfc/cable-robot")
    return Path(folder) / "Firmware" / "gerry07_mcu_only_t4" / "data"


@pytest.mark.slow
@pytest.mark.parametrize("name", LOGS)
def test_the_four_cable_robot_is_calibrated_as_its_page_says(cdpr, logs, tmp_path, name):
    done = run_reader(logs / f"{name}.txt", out=tmp_path)
    assert done.returncode == 0, done.stderr
    before, after = calibrated(cdpr, tmp_path, name).T
    assert np.sqrt(np.mean(before**2)) > 40.0
    assert np.sqrt(np.mean(after**2)) < 5.2


@pytest.mark.slow
@pytest.mark.timeout(1800)
def test_friction_of_the_four_cable_robot(cdpr, logs, tmp_path):
    name = LOGS[0]
    done = run_reader(logs / f"{name}.txt", out=tmp_path)
    assert done.returncode == 0, done.stderr
    calibrated(cdpr, tmp_path, name)
    cdpr(
        *("discover", "--data", f"{name}.csv", "--model", f"{name}-calibrated.toml"),
        *("--out", "found"),
        cwd=tmp_path,
        timeout=1700,
    )
    found = json.loads((tmp_path / "found" / "discovery.json").read_text(encoding="utf-8"))
    first = found["effects"][0]
    assert first["cable"] is None
    assert "friction" in first["id"] or "capstan" in first["id"], first
    assert found["gap"]["holdout"]["after"] < 0.5 * found["gap"]["holdout"]["before"]


def test_the_drive_has_its_motor_on_the_first_cable(cdpr, tmp_path):
    time = np.arange(4000) * 1e-3
    position, voltage = 0.12 + 0.1 * np.sin(time), 2.0 * np.cos(time)
    savemat(tmp_path / "drive.mat", {"qm": position, "vir": voltage, "gtau": 35.0})
    done = run_reader(tmp_path / "drive.mat", out=tmp_path, reader=DRIVE)
    assert done.returncode == 0, done.stderr
    table = np.genfromtxt(tmp_path / "emps.csv", delimiter=",", names=True)
    assert len(table) == 200
    assert np.diff(table["time"]) == pytest.approx(0.02, rel=1e-3)
    # A force holds until the next row, so it is the mean of what the motor does until then.
    assert table["winch_force1"] - 400.0 == pytest.approx(
        70.0 * np.cos(0.02 * np.arange(200) + 0.0095), abs=0.02
    )
    assert table["x"] == pytest.approx(0.1 * np.sin(0.02 * np.arange(200)), abs=1e-9)
    # The cables behind pull as much along the rail as the first one without the motor.
    assert 2 * table["winch_force2"] * 10 / np.hypot(10, 0.5) == pytest.approx(400.0)
    cdpr("model", "--check", tmp_path / "emps.toml")
    savemat(tmp_path / "other.mat", {"qm": position})
    other = run_reader(tmp_path / "other.mat", out=tmp_path, reader=DRIVE)
    assert other.returncode != 0
    assert "other.mat: no variable vir, gtau" in other.stderr


@pytest.mark.slow
def test_friction_of_the_drive(cdpr, tmp_path):
    recording = os.environ.get("CDPR_EMPS")
    if not recording:
        pytest.skip("CDPR_EMPS does not name the file nlid_emps_sim_data_training.mat")
    done = run_reader(Path(recording), out=tmp_path, reader=DRIVE)
    assert done.returncode == 0, done.stderr
    cdpr(
        *("discover", "--data", "emps.csv", "--model", "emps.toml", "--out", "found"),
        cwd=tmp_path,
        timeout=280,
    )
    found = json.loads((tmp_path / "found" / "discovery.json").read_text(encoding="utf-8"))
    laws = ("winch_coulomb_friction", "winch_stribeck_friction")
    friction = next(effect for effect in found["effects"] if effect["id"] in laws)
    # More one way than the other: the constant force that others find beside friction.
    assert friction["parameters"]["asymmetry"]["value"] == pytest.approx(0.13, abs=0.03)
    five_seconds = next(left for left in found["remaining"] if left["horizon_s"] == 5.0)
    assert five_seconds["position_mm"] < 4.0
    assert found["gap"]["holdout"]["after"] < 0.1 * found["gap"]["holdout"]["before"]
