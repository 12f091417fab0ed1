"""The examples in Python, run as their pages say."""

import importlib.util
import json
import os
import re
import shlex
import shutil
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest

ROOT = Path(__file__).resolve().parents[2]
EXAMPLES = ROOT / "examples"
pytestmark = pytest.mark.slow


def load(script):
    """The script as a module."""
    spec = importlib.util.spec_from_file_location(script.stem, script)
    module = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    return module


def run_as_its_first_line_says(script, fmu, folder):
    """What the script prints, run by the command in its first line beside a `CablePlatform.fmu`."""
    first = script.read_text(encoding="utf-8").splitlines()[0]
    python, file, *arguments = shlex.split(first.removeprefix('"""Run as: '))
    assert python == "python"
    assert ROOT / file == script
    shutil.copy(fmu.path, folder / "CablePlatform.fmu")
    done = subprocess.run(
        [sys.executable, script, *arguments],
        cwd=folder,
        capture_output=True,
        text=True,
        timeout=120,
        check=False,
    )
    assert done.returncode == 0, done.stderr
    assert (folder / arguments[-1]).stat().st_size > 10_000
    return done.stdout


def figures(text):
    """All numbers of a text, in their order."""
    return [float(n) for n in re.findall(r"[-+]?\d+\.?\d*", text)]


def block_of_page(script, begins):
    """The block of the example's page that begins with these words."""
    blocks = (script.parent / "README.md").read_text(encoding="utf-8").split("```text\n")
    return next(block for block in blocks if block.startswith(begins)).split("```")[0]


def test_discover_from_python(cdpr_bin, tmp_path):
    script = EXAMPLES / "discover_from_python" / "discover.py"
    done = subprocess.run(
        [sys.executable, script, tmp_path / "out"],
        capture_output=True,
        text=True,
        timeout=280,
        check=False,
        env=os.environ | {"CDPR_BIN": str(cdpr_bin)},
    )
    assert done.returncode == 0, done.stderr
    shown = re.findall(r"is off by (\S+) times the noise \((\w+)\)", done.stdout)
    gap = {side: float(value) for value, side in shown}
    assert gap["before"] > 10.0
    assert gap["after"] < 1.1
    assert (tmp_path / "out" / "gap.png").stat().st_size > 10_000


def test_the_lines_for_fmpy_in_the_readme_release_the_platform(fmu, tmp_path):
    """But for the plot, which opens a browser."""
    readme = (ROOT / "README.md").read_text(encoding="utf-8")
    block = next(b for b in readme.split("```python\n") if b.startswith("from fmpy"))
    *lines, plot = block.split("```")[0].splitlines()
    assert plot.startswith("plot_result")
    shutil.copy(fmu.path, tmp_path / "CablePlatform.fmu")
    done = subprocess.run(
        [sys.executable, "-c", "\n".join(lines)],
        cwd=tmp_path,
        capture_output=True,
        text=True,
        timeout=120,
        check=False,
    )
    assert done.returncode == 0, done.stderr
    # The values of `src/release.rs` after 50 s.
    assert figures(done.stdout) == pytest.approx([0.01818326125, 0.2778655904], rel=1e-6)


PD = EXAMPLES / "pd_in_fmpy" / "pd.py"


def test_pd_in_fmpy_tracks_the_circle_as_its_page_says(fmu, tmp_path):
    shown = run_as_its_first_line_says(PD, fmu, tmp_path)
    error, angle, lowest, highest, slackest, tautest = figures(shown)
    assert error < 1.2  # mm
    assert angle < 0.05  # mrad
    assert 19.5e3 < lowest < highest < 20.5e3
    assert 19.5e3 < slackest < tautest < 20.5e3
    page = block_of_page(PD, "largest tracking error")
    assert figures(shown) == pytest.approx(figures(page), rel=0.01)


def test_pd_in_fmpy_starts_at_rest_under_20_kn(fmu):
    rows = load(PD).simulate(fmu.path)
    assert np.mean(rows[0, 7:11]) == pytest.approx(20e3, rel=1e-4)
    assert rows[0, 11:] == pytest.approx(rows[0, 7:11], rel=1e-6)
    assert np.abs(np.diff(rows[:10, 1:4], axis=0)).max() < 1e-6


def test_pd_in_fmpy_needs_its_low_pass_and_its_feedback(fmu, monkeypatch):
    """What the page says of both; were it otherwise, the tracking would prove nothing."""
    pd = load(PD)
    with monkeypatch.context() as patch:
        patch.setattr(pd, "LOW_PASS", 1e-6)
        tensions = pd.simulate(fmu.path)[:, 11:]
    assert tensions.min() == 0.0
    assert tensions.max() == pytest.approx(74e3, rel=0.05)
    monkeypatch.setattr(pd, "BANDWIDTH", 0.0)
    rows = pd.simulate(fmu.path)
    assert np.hypot(*(rows[:, 1:3] - rows[:, 4:6]).T).max() > 0.01


LQR = EXAMPLES / "lqr_from_fmu" / "lqr.py"


def test_lqr_from_fmu_comes_to_rest_as_its_page_says(fmu, tmp_path):
    shown = run_as_its_first_line_says(LQR, fmu, tmp_path)
    growth, _, decay, _, far, near, after, off, lowest, highest = figures(shown)
    assert growth == pytest.approx(0.1512, abs=2e-4)  # of the crossed cables, in φ
    assert decay > 0.3
    assert far == pytest.approx(11180.0, abs=1.0)
    assert near < 10.0  # mm
    assert after == 20.0
    assert 0.0 < off < 10.0  # mm: the FMU is nonlinear, the model is its tangent
    assert 14e3 < lowest < highest < 25e3
    page = block_of_page(LQR, "fastest growth")
    assert figures(shown) == pytest.approx(figures(page), rel=0.01)


def test_lqr_from_fmu_reads_the_matrices_that_analyse_writes(fmu, cdpr, tmp_path):
    """The same point: 20 kN is the middle of the bounds."""
    bounds = ["--tension-min", 15e3, "--tension-max", 25e3]
    cdpr("analyse", "--pose", "0,0,0", *bounds, "--linear", tmp_path / "linear.json")
    written = json.loads((tmp_path / "linear.json").read_text(encoding="utf-8"))
    lqr = load(LQR)
    model = lqr.linear_model(lqr.Plant(fmu.path))
    assert sorted(model.state_labels) == sorted(written["states"])
    states = [written["states"].index(name) for name in model.state_labels]
    inputs = [written["inputs"].index(name) for name in model.input_labels]
    outputs = [written["outputs"].index(name) for name in model.output_labels]
    for name, rows, columns in [
        ("A", states, states),
        ("B", states, inputs),
        ("C", outputs, states),
        ("D", outputs, inputs),
    ]:
        expected = np.array(written[name])[np.ix_(rows, columns)]
        assert getattr(model, name) == pytest.approx(expected, rel=1e-6, abs=1e-8), name


def test_lqr_from_fmu_without_its_gain_turns_away(fmu):
    lqr = load(LQR)
    plant = lqr.Plant(fmu.path)
    *_, outputs = lqr.simulate(fmu.path, plant.get(plant.states), np.zeros((4, 14)))
    assert abs(outputs[-1, 2]) > 5 * lqr.OFFSET[2]
