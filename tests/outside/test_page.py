"""The page inside the FMU: what it says is what there is."""

from __future__ import annotations

import html
import re
import shutil
import subprocess
import sys
import zipfile

import numpy as np
import pytest
from lxml import etree

from outside.fmu import Fmu


@pytest.fixture(scope="module")
def page(fmu) -> str:
    """The page's text."""
    return (fmu.folder / "documentation" / "index.html").read_text(encoding="utf-8")


def code_of(page, identifier):
    """The code in a `pre` element."""
    found = re.search(rf'<pre id="{identifier}">(.*?)</pre>', page, re.DOTALL)
    return html.unescape(found.group(1))


def run(code, folder):
    """What the code prints."""
    done = subprocess.run(
        [sys.executable, "-c", code],
        cwd=folder,
        capture_output=True,
        text=True,
        timeout=300,
        check=False,
    )
    assert done.returncode == 0, done.stderr
    return done.stdout


def test_every_value_of_an_enumeration_is_listed(fmu, page):
    for variable in fmu.description.modelVariables:
        if variable.type == "Enumeration":
            for item in variable.declaredType.items:
                assert f"<code>{item.name}</code> ({item.value})" in page, variable.name


def test_no_markdown_is_left(page):
    assert "`" not in page


def test_the_robot_is_drawn_with_its_cables_by_number(page):
    svg = etree.fromstring(re.search(r"<svg.*?</svg>", page, re.DOTALL).group(0))
    numbers = [t.text for t in svg.iter("{*}text") if t.get("class") == "robot-number"]
    assert numbers == ["1", "2", "3", "4"]


def test_the_step_loop_of_the_page_runs_from_rest_to_its_target(fmu, page, tmp_path):
    shutil.copy(fmu.path, tmp_path / "CablePlatform.fmu")
    code = code_of(page, "loop")
    # At rest before the loop: nothing accelerates.
    still = code.split("mass, inertia =")[0] + (
        "print([fmu.getReal([refs[f'der({n})']])[0] for n in ('vx', 'vy', 'omega')])\n"
    )
    assert np.abs(eval(run(still, tmp_path))).max() < 1e-8
    assert eval(run(code, tmp_path)) == pytest.approx([25.0, 0.0, 0.1], abs=1e-3)


def test_a_plain_pd_without_the_low_pass_of_the_page_drives_the_cables(fmu, page, tmp_path):
    shutil.copy(fmu.path, tmp_path / "CablePlatform.fmu")
    speeds = "rates = [refs[f'unstretched_length_rate[{i}]'] for i in range(1, 5)]\n"
    shown = "print(max(map(abs, fmu.getReal(rates))))\nfmu.terminate()"
    code = code_of(page, "loop").replace(
        "print(fmu.getReal(pose))\nfmu.terminate()", speeds + shown
    )
    plain = code.replace("(1 - np.exp(-step / low_pass))", "1.0")
    assert plain != code
    quiet, driven = (float(run(text, tmp_path).split()[-1]) for text in (code, plain))
    assert quiet < 1e-3
    assert driven > 100 * quiet


def test_a_model_is_changed_as_the_page_says(fmu, page, cdpr_bin, tmp_path):
    change = re.search(r'id="change".*?<pre>(.*?)</pre>', page, re.DOTALL).group(1)
    lines = html.unescape(change).splitlines()
    unpack, pack = lines[0], lines[-1]
    assert unpack == "unzip -p CablePlatform.fmu resources/model.toml > model.toml"
    with zipfile.ZipFile(fmu.path) as archive:
        model = archive.read("resources/model.toml").decode()
    added = [line.lstrip("# ") for line in lines[2:-1]]
    (tmp_path / "model.toml").write_text("\n".join([model, *added]), encoding="utf-8")
    command, *arguments = pack.split()
    assert command == "cdpr"
    subprocess.run([cdpr_bin, *arguments], cwd=tmp_path, check=True, timeout=60)
    changed = Fmu.unpack(tmp_path / "Changed.fmu", tmp_path / "changed")
    with changed.instance() as instance:
        assert instance.get(["effect.winch_coulomb_friction[3].force"]) == 250.0
