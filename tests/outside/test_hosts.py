"""What is seen in real hosts: odd resource locations, names, missing callbacks, fmpy's own loop."""

from __future__ import annotations

import shutil
import subprocess
import sys
import urllib.parse
from ctypes import byref, c_double, c_int
from pathlib import Path

import numpy as np
import pytest
from fmpy import simulate_fmu

from outside.cases import assert_close, random_case, reference_run, starting
from outside.fmu import INPUTS, OUTPUTS, SLACK, start_values
from outside.host import DISCARD, ERROR, OK, WARNING, Host
from reference.parameters import LUMPED_MASS, Effect, Parameters
from reference.plant import Plant

MASS = 2345.0


@pytest.fixture(scope="module")
def heavy(pack):
    """An FMU whose model file, if found, shows in the platform's mass."""
    return pack(Parameters(platform_mass=MASS))


def uri_forms(folder):
    """The same folder as different hosts write it."""
    path = (folder / "resources").resolve().as_posix()
    quoted = urllib.parse.quote(path)
    return {
        "file:///": "file://" + quoted,
        "file:/": "file:" + quoted,
        "file:////": "file:///" + quoted,
        "localhost": "file://localhost" + quoted,
        "trailing slash": "file://" + quoted + "/",
        "FILE": "FILE://" + quoted,
        "not encoded": "file://" + path,
        "all encoded": "file://"
        + "".join(c if c == "/" else "".join(f"%{b:02x}" for b in c.encode()) for c in path),
    }


@pytest.mark.parametrize("folder_name", ["plain", "with some spaces", "Größe µ 模型", "100%25 +&#"])
@pytest.mark.parametrize("form", list(uri_forms(Path())))
def test_resource_locations(heavy, tmp_path, folder_name, form):
    folder = shutil.copytree(heavy.folder, tmp_path / folder_name)
    uri = uri_forms(folder)[form]
    if form == "not encoded" and "%" in folder_name:
        uri = uri.replace("%", "%25")  # the one character that cannot be left as it is
    host = Host(folder)
    component = host.initialised(resources=uri.encode())
    assert host.real(component, "platform_mass") == MASS
    assert host.DoStep(component, 0.0, 0.1, 1) == OK
    host.free(component)


def test_no_resource_location_means_the_default_model(fmu):
    host = Host(fmu.folder)
    component = host.initialised(resources=None)
    assert host.real(component, "platform_mass") == 2500.0
    host.free(component)


@pytest.mark.parametrize(
    "uri", [b"http://example.org/resources", b"nonsense", b"file:///no/such/folder", b"\xff\xfe%zz"]
)
def test_a_location_that_cannot_be_read_is_said_so(heavy, uri):
    """Falling back to the default model would silently simulate something else."""
    host = Host(heavy.folder)
    component = host.instantiate(resources=uri, logger=host.logger, logging_on=True)
    assert not component
    assert any(status >= ERROR for status, _, _ in host.messages)
    host.prove_alive()


def test_a_broken_model_file_is_said_so(heavy, tmp_path):
    folder = shutil.copytree(heavy.folder, tmp_path / "broken")
    (folder / "resources" / "model.toml").write_text("platform_mass = 'heavy'\n")
    host = Host(folder)
    assert not host.instantiate(logger=host.logger, logging_on=True)
    text = " ".join(message for _, _, message in host.messages)
    assert "model.toml" in text
    assert "platform_mass" in text


def test_a_model_file_with_another_interface_is_refused(heavy, tmp_path):
    """The description promises variables; a changed file must not change them unseen."""
    folder = shutil.copytree(heavy.folder, tmp_path / "other")
    changed = Parameters(
        effects=(Effect("platform_quadratic_drag", None, {"coefficient": 30.0}),)
    ).to_toml()
    (folder / "resources" / "model.toml").write_text(changed)
    host = Host(folder)
    assert not host.instantiate(logger=host.logger, logging_on=True)
    assert host.messages


@pytest.mark.parametrize("name", ["plant one", "über 模型", "a/b\\c", "x" * 5000, "{}", "%s%n"])
def test_instance_names(fmu, name):
    host = Host(fmu.folder)
    component = host.initialised(name=name.encode(), logger=host.logger, logging_on=True)
    assert host.DoStep(component, 0.0, 0.1, 1) == OK
    host.free(component)


def test_a_name_that_is_not_utf8(fmu):
    host = Host(fmu.folder)
    component = host.instantiate(name=b"caf\xe9")
    if component:
        host.free(component)
    host.prove_alive()


def test_errors_without_a_logger(fmu):
    host = Host(fmu.folder)
    component = host.initialised(logging_on=True)
    assert host.set_real(component, "tension[1]", 1.0) == ERROR
    host.free(component)


def test_logging_is_off_until_switched_on(fmu):
    host = Host(fmu.folder)
    component = host.instantiate(logger=host.logger, logging_on=False)
    assert host.SetDebugLogging(component, 0, 0, None) == OK
    host.initialise(component)
    assert host.DoStep(component, 0.0, 0.1, 1) == OK
    assert host.messages == []
    host.free(component)


def test_errors_are_logged_with_a_declared_category(fmu):
    host = Host(fmu.folder)
    declared = {c.name for c in fmu.description.logCategories}
    component = host.initialised(logger=host.logger, logging_on=True)
    assert host.set_real(component, "tension[1]", 1.0) == ERROR
    errors = [m for m in host.messages if m[0] == ERROR]
    assert errors
    assert {category for _, category, _ in host.messages} <= declared
    assert any("tension[1]" in message for _, _, message in errors)
    host.free(component)


@pytest.mark.parametrize("tolerance", [None, 1e-3, 1e-9])
def test_tolerance_defined_or_not(fmu, tolerance):
    host = Host(fmu.folder)
    component = host.instantiate()
    defined = int(tolerance is not None)
    assert host.SetupExperiment(component, defined, tolerance or 0.0, 0.0, 0, 0.0) == OK
    assert host.EnterInitializationMode(component) == OK
    assert host.ExitInitializationMode(component) == OK
    assert host.DoStep(component, 0.0, 0.1, 1) == OK
    host.free(component)


def test_stop_time_that_is_not_defined_is_no_limit(fmu):
    host = Host(fmu.folder)
    component = host.instantiate()
    assert host.SetupExperiment(component, 0, 0.0, 0.0, 0, 0.05) == OK
    assert host.EnterInitializationMode(component) == OK
    assert host.ExitInitializationMode(component) == OK
    assert host.DoStep(component, 0.0, 1.0, 1) == OK
    host.free(component)


def test_version_and_platform(fmu):
    host = Host(fmu.folder)
    assert host.library.fmi2GetVersion() == b"2.0"
    assert host.library.fmi2GetTypesPlatform() == b"default"


def test_inputs_set_in_initialisation_mode_show_in_the_outputs(fmu):
    host = Host(fmu.folder)
    component = host.instantiate()
    rigid = fmu.enumeration("cable_model", "rigid")
    assert host.SetInteger(component, host.refs("cable_model"), 1, byref(c_int(rigid))) == OK
    assert host.SetupExperiment(component, 0, 0.0, 0.0, 0, 0.0) == OK
    assert host.EnterInitializationMode(component) == OK
    read = []
    for force in (5000.0, 9000.0):
        for k in range(1, 5):
            assert host.set_real(component, f"winch_force[{k}]", force) == OK
        value = c_double()
        assert host.GetReal(component, host.refs("tension[1]"), 1, byref(value)) == OK
        read.append(value.value)
    assert read == pytest.approx([5000.0, 9000.0], rel=0.05)
    host.free(component)


def test_simulate_fmu_with_inputs(fmu):
    """fmpy's own master, with its own treatment of input tables."""
    case = random_case(17, LUMPED_MASS)
    knots = np.round(case.inputs.times, 2)
    case.inputs.times = [float(t) for t in knots]
    rows = []
    for k, time in enumerate(knots):
        if k:  # two rows at one time make a jump
            rows.append((time, *case.inputs.values[k - 1]))
        rows.append((time, *case.inputs.values[k]))
    signals = np.array(rows, dtype=[("time", float), *((name, float) for name in INPUTS)])
    _, values = starting(case, Plant(case.parameters))
    values |= start_values(case.parameters)
    for name in ("cable_model", "initialization"):
        values[name] = fmu.enumeration(name, values[name])
    values = {k: v for k, v in values.items() if k not in INPUTS}
    result = simulate_fmu(
        str(fmu.folder),
        stop_time=case.end,
        output_interval=0.1,
        start_values=values,
        input=signals,
        output=[*OUTPUTS, *SLACK],
    )
    found = {name: result[name] for name in OUTPUTS}
    assert_close(found, reference_run(case, result["time"]))


def test_simulate_fmu_with_nothing_but_defaults(fmu):
    result = simulate_fmu(str(fmu.path), stop_time=2.0)
    assert np.isfinite(result["x"]).all()
    assert len(result) > 10


def test_importing_prints_nothing(fmu):
    """A library has no business on its host's standard output."""
    code = (
        "import sys; from fmpy import simulate_fmu; "
        "simulate_fmu(sys.argv[1], stop_time=1.0, debug_logging=False)"
    )
    done = subprocess.run(
        [sys.executable, "-c", code, fmu.path], capture_output=True, timeout=60, check=True
    )
    assert done.stdout == b""
    assert done.stderr == b""


@pytest.mark.parametrize("logging_on", [False, True])
def test_a_warning_does_not_end_the_run(fmu, logging_on):
    """The release of the README beyond 82.6 s, where a cable comes to lie across the platform.

    fmusim, OMSimulator and PyFMI end a run at fmi2Warning.
    """
    host = Host(fmu.folder)
    component = host.instantiate(logger=host.logger, logging_on=logging_on)
    for name in ("x", "y", "phi"):
        assert host.set_real(component, name, 0.1) == OK
    host.initialise(component)
    for k in range(900):
        assert host.DoStep(component, 0.1 * k, 0.1, 1) == OK, (k, host.messages)
    warnings = [text for status, _, text in host.messages if status == WARNING]
    assert len(warnings) == 1, warnings
    assert "runs through the platform from t = 82." in warnings[0]
    host.free(component)


def test_a_discard_without_logging_on_tells_its_reason(fmu):
    host = Host(fmu.folder)
    component = host.initialised(logger=host.logger, logging_on=False)
    assert host.set_real(component, "disturbance_force_y", 5e6) == OK
    assert host.DoStep(component, 0.0, 60.0, 1) == DISCARD
    assert [status for status, _, _ in host.messages if status == DISCARD], host.messages
    assert any("left the space between the anchors" in text for _, _, text in host.messages)
    host.free(component)


def test_an_edited_model_file_is_told_with_its_folder_and_the_way_out(heavy, tmp_path):
    folder = Path(shutil.copytree(heavy.folder, tmp_path / "edited"))
    (folder / "resources" / "model.toml").write_text("platform_mass = 2346.0\n")
    host = Host(folder)
    assert not host.instantiate(logger=host.logger)
    (status, _, text), *rest = host.messages
    assert status == ERROR
    assert not rest
    assert str((folder / "resources").resolve()) in text
    assert "where these were changed, pack the FMU anew with cdpr" in text
