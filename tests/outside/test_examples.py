"""The examples in Python, run as their pages say."""

import os
import re
import subprocess
import sys
from pathlib import Path

import pytest

EXAMPLES = Path(__file__).resolve().parents[2] / "examples"


@pytest.mark.slow
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
