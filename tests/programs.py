"""The workspace's example programs, which the tests run."""

from __future__ import annotations

import os
import subprocess
import sys
from pathlib import Path

ROOT = Path(__file__).resolve().parent.parent


def run_example(package: str, name: str, *arguments: str | Path) -> None:
    """Runs an example of a package with these arguments.

    CDPR_EXAMPLES names a folder where it stands built. Without it cargo builds it, and compiles
    anew what this package alone asks fewer features of than the workspace does.
    """
    if folder := os.environ.get("CDPR_EXAMPLES"):
        suffix = ".exe" if sys.platform == "win32" else ""
        program = [Path(folder).resolve() / f"{name}{suffix}"]
    else:
        cargo = [os.environ.get("CARGO", "cargo"), "run", "--quiet", "--release", "--locked"]
        program = [*cargo, "--package", package, "--example", name, "--"]
    subprocess.run([*program, *arguments], cwd=ROOT, check=True)
