"""What the tests share: the real binary, and FMUs packed by it."""

from __future__ import annotations

import hashlib
import os
import shutil
import subprocess
import sys
from collections.abc import Callable
from pathlib import Path

import pytest

from outside.fmu import Fmu
from programs import run_example
from reference.parameters import Parameters

ROOT = Path(__file__).resolve().parent.parent


@pytest.fixture(scope="session")
def cdpr_bin() -> Path:
    """The `cdpr` binary: named by CDPR_BIN, else the release build of this checkout."""
    suffix = ".exe" if sys.platform == "win32" else ""
    path = Path(os.environ.get("CDPR_BIN", ROOT / "target" / "release" / f"cdpr{suffix}"))
    if not path.is_file():
        pytest.fail(
            f"{path} is missing: run `cargo build --release` or set CDPR_BIN", pytrace=False
        )
    return path.resolve()


@pytest.fixture(scope="session")
def cdpr(cdpr_bin) -> Callable[..., subprocess.CompletedProcess]:
    """Run `cdpr` with arguments; `ok=True` (the default) insists on exit code 0."""

    def run(*arguments, ok=True, cwd=None, timeout=120):
        done = subprocess.run(
            [cdpr_bin, *map(str, arguments)],
            capture_output=True,
            text=True,
            cwd=cwd,
            timeout=timeout,
            check=False,
        )
        if ok:
            assert done.returncode == 0, f"{done.args} gave {done.returncode}\n{done.stderr}"
        return done

    return run


@pytest.fixture(scope="session")
def pack(cdpr, tmp_path_factory) -> Callable[..., Fmu]:
    """An FMU of a model (TOML text, Parameters, or None for the default), packed once each."""
    packed: dict[str, Fmu] = {}

    def make(model: Parameters | str | None = None) -> Fmu:
        text = model.to_toml() if isinstance(model, Parameters) else model
        key = hashlib.sha256((text or "").encode()).hexdigest()[:16]
        if key not in packed:
            folder = tmp_path_factory.mktemp("fmu")
            fmu = folder / "CablePlatform.fmu"
            arguments = ["fmu", "-o", fmu]
            if text is not None:
                (folder / "model.toml").write_text(text)
                arguments += ["--model", folder / "model.toml"]
            cdpr(*arguments)
            packed[key] = Fmu.unpack(fmu, folder / "unpacked")
        return packed[key]

    return make


@pytest.fixture(scope="session")
def fmu(pack) -> Fmu:
    """The FMU of the default model."""
    return pack()


@pytest.fixture
def fmu_copy(fmu, tmp_path) -> Callable[[str], Path]:
    """A copy of the unpacked default FMU in a folder of the given name."""

    def copy(name: str) -> Path:
        return Path(shutil.copytree(fmu.folder, tmp_path / name))

    return copy


def packed_controller(path: Path, *arguments) -> Path:
    """The winch controller's FMU, as its example packs it with these arguments."""
    run_example("winch-controller", "pack", *arguments, path)
    return path


@pytest.fixture(scope="session")
def controller_fmu(tmp_path_factory) -> Path:
    """The winch controller's FMU for the default robot."""
    return packed_controller(tmp_path_factory.mktemp("controller") / "WinchController.fmu")


@pytest.fixture
def controller_of(tmp_path) -> Callable[[str], Path]:
    """The winch controller's FMU for the robot of a model (TOML text)."""

    def make(model: str) -> Path:
        file = tmp_path / "robot.toml"
        file.write_text(model)
        return packed_controller(tmp_path / "WinchController.fmu", "--model", file)

    return make
