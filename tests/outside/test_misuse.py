"""A host that misbehaves is told so, and lives."""

from __future__ import annotations

import subprocess
import sys

import pytest

from outside import misuse


@pytest.mark.parametrize("name", misuse.CASES)
def test_misuse_is_an_error_and_the_host_lives(fmu, name):
    done = subprocess.run(
        [sys.executable, misuse.__file__, fmu.folder, name],
        capture_output=True,
        text=True,
        timeout=60,
        check=False,
    )
    assert done.returncode == 0, f"exit code {done.returncode}\n{done.stderr}"
    assert done.stdout.endswith("alive\n")
    # Nothing of ours is printed over the host's own output.
    assert done.stderr == ""
