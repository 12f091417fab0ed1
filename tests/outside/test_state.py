"""Saving, restoring, repeating: bit for bit."""

from __future__ import annotations

import subprocess
import sys
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path

import numpy as np
import pytest

from outside import resume
from outside.cases import EFFECTS, random_case, starting
from outside.fmu import Fmu, Instance, start_values
from reference.parameters import CABLE_MODELS, LUMPED_MASS
from reference.plant import Plant


def prepared(model: str, seed: int = 7) -> dict:
    """Start values of a moving platform."""
    case = random_case(seed, model)
    _, values = starting(case, Plant(case.parameters))
    return values | start_values(case.parameters)


@pytest.fixture(scope="module")
def effective(pack) -> tuple[Fmu, dict]:
    """An FMU with states and histories in its effects, and its start values."""
    case = random_case(8, LUMPED_MASS, effects=tuple(EFFECTS.values()))
    _, values = starting(case, Plant(case.parameters))
    return pack(case.parameters), values


def same(a: np.ndarray, b: np.ndarray) -> bool:
    return a.tobytes() == b.tobytes()


def warm_up(instance: Instance):
    for size in (0.1, 0.033, 0.05):
        instance.step(size)
    instance.set({"winch_force[1]": 7000.0, "disturbance_torque": 500.0})
    instance.step(0.021)


@pytest.mark.parametrize("solver", ["radau", "dormand_prince", "auto"])
@pytest.mark.parametrize("model", CABLE_MODELS)
def test_a_saved_state_is_returned_to_bit_for_bit(fmu, model, solver):
    with fmu.instance(values=prepared(model) | {"solver": solver}) as instance:
        warm_up(instance)
        saved, time, before = instance.slave.getFMUstate(), instance.time, instance.snapshot()
        runs = []
        for _ in range(2):
            instance.slave.setFMUstate(saved)
            instance.time = time
            assert same(instance.snapshot(), before)
            resume.go_on(instance)
            runs.append(instance.snapshot())
        instance.slave.freeFMUstate(saved)
    assert same(*runs)
    assert not same(runs[0], before)


def test_restoring_brings_back_the_inputs_and_their_slopes(fmu):
    with fmu.instance(values=prepared(LUMPED_MASS)) as instance:
        reference = fmu.references(["winch_force[3]"])
        instance.slave.setRealInputDerivatives(reference, [1], [500.0])
        instance.step(0.1)
        saved, time = instance.slave.getFMUstate(), instance.time
        instance.step(0.2)
        ramped = instance.snapshot()
        instance.slave.setFMUstate(saved)
        instance.time = time
        instance.set({"winch_force[3]": 0.0})
        instance.step(0.2)
        assert not same(instance.snapshot(), ramped)
        instance.slave.setFMUstate(saved)
        instance.time = time
        instance.step(0.2)
        assert same(instance.snapshot(), ramped)
        instance.slave.freeFMUstate(saved)


def test_a_state_can_be_saved_over(fmu):
    from ctypes import byref

    from fmpy.fmi2 import fmi2FMUstate

    with fmu.instance(values=prepared(LUMPED_MASS)) as instance:
        state = fmi2FMUstate()
        get = instance.slave.fmi2GetFMUstate
        get(instance.slave.component, byref(state))
        warm_up(instance)
        get(instance.slave.component, byref(state))
        after = instance.snapshot()
        instance.step(0.3)
        instance.slave.setFMUstate(state)
        assert same(instance.snapshot(), after)
        instance.slave.freeFMUstate(state)


@pytest.mark.parametrize("model", CABLE_MODELS)
def test_serialised_state_goes_into_another_instance(fmu, model):
    with fmu.instance(values=prepared(model)) as first, fmu.instance("b", start=False) as second:
        warm_up(first)
        second.restore(first.serialised())
        second.time = first.time
        for instance in (first, second):
            resume.go_on(instance)
        assert same(first.snapshot(), second.snapshot())
        assert first.serialised() == second.serialised()


def test_serialised_state_goes_on_in_another_process(effective, tmp_path):
    fmu, values = effective
    with fmu.instance(values=values) as instance:
        warm_up(instance)
        state, out = tmp_path / "state.bin", tmp_path / "out.bin"
        state.write_bytes(instance.serialised())
        script = Path(resume.__file__)
        subprocess.run(
            [sys.executable, script, fmu.folder, state, instance.time.hex(), out],
            check=True,
            timeout=120,
        )
        resume.go_on(instance)
        assert out.read_bytes() == instance.snapshot().tobytes()


def test_a_state_may_be_freed_without_being_used(fmu):
    with fmu.instance(values=prepared(LUMPED_MASS)) as instance:
        states = [instance.slave.getFMUstate() for _ in range(3)]
        instance.step(0.1)
        for state in states:
            instance.slave.freeFMUstate(state)
        instance.step(0.1)


def test_reset_and_run_again(effective):
    fmu, values = effective
    runs, fresh = [], []
    with fmu.instance(start=False) as instance:
        for _ in range(2):
            # Nothing of the run before is left: neither values nor parameters.
            instance.begin()
            fresh.append(instance.snapshot())
            instance.slave.reset()
            instance.initialise(values | {"platform_mass": 2700.0})
            warm_up(instance)
            runs.append(instance.snapshot())
            instance.slave.reset()
        assert same(*fresh)
        runs.clear()
        for _ in range(2):
            instance.initialise(values)
            warm_up(instance)
            runs.append(instance.snapshot())
            instance.slave.reset()
        instance.initialise(values)
        warm_up(instance)
        instance.slave.terminate()
        terminated = instance.snapshot()
        instance.slave.reset()
    assert same(runs[0], runs[1])
    assert same(runs[0], terminated)


def test_results_repeat_in_a_new_instance(effective):
    fmu, values = effective
    runs = []
    for name in ("one", "another"):
        with fmu.instance(name, values) as instance:
            warm_up(instance)
            runs.append(instance.snapshot())
    assert same(*runs)


def test_interleaved_instances_do_not_disturb_each_other(effective):
    fmu, values = effective
    other = values | {"vx": -0.4, "winch_force[4]": 11000.0}
    alone = []
    for start in (values, other):
        with fmu.instance(values=start) as instance:
            warm_up(instance)
            resume.go_on(instance)
            alone.append(instance.snapshot())
    with fmu.instance("a", values) as a, fmu.instance("b", other) as b:
        pair = (a, b)
        for size in (0.1, 0.033, 0.05):
            for instance in pair:
                instance.step(size)
        for instance in pair:
            instance.set({"winch_force[1]": 7000.0, "disturbance_torque": 500.0})
        for instance in pair:
            instance.step(0.021)
        for k, size in enumerate(resume.STEPS):
            for instance in reversed(pair):
                if k == 2:
                    instance.set({"winch_force[2]": resume.NEW_FORCE})
                instance.step(size)
        together = [instance.snapshot() for instance in pair]
    assert same(together[0], alone[0])
    assert same(together[1], alone[1])
    assert not same(*together)


def test_eight_threads(effective):
    fmu, values = effective
    starts = [values | {"vx": 0.1 * k, "disturbance_force_y": 50.0 * k} for k in range(8)]

    def run(instance):
        for _ in range(40):
            instance.step(0.05)
        return instance.snapshot()

    def all_runs(mapper):
        instances = [fmu.instance(f"thread {k}", start) for k, start in enumerate(starts)]
        try:
            return list(mapper(run, instances))
        finally:
            for instance in instances:
                instance.slave.freeInstance()

    one_by_one = all_runs(map)
    with ThreadPoolExecutor(8) as pool:
        threaded = all_runs(pool.map)
    assert all(same(a, b) for a, b in zip(one_by_one, threaded, strict=True))
    assert len({r.tobytes() for r in threaded}) == 8
