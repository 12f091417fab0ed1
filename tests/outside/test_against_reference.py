"""The FMU's motion against the independent model."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from outside.cases import (
    Case,
    assert_close,
    fmu_run,
    random_case,
    reference_run,
    starting,
)
from outside.fmu import OUTPUTS, POSE, SLACK, input_values, start_values
from reference.parameters import CABLE_MODELS, LUMPED_MASS, Inputs
from reference.plant import Plant
from reference.test_reference import RELEASE_TABLE


# Pose (absolute), length (relative), tension (relative): how close the integrator comes by itself,
# and when asked to do its best.
@pytest.mark.parametrize(
    ("options", "bounds"),
    [({}, (1e-7, 1e-9, 2e-6)), ({"relative_tolerance": 1e-12}, (1e-10, 1e-10, 2e-9))],
    ids=["default tolerance", "tight tolerance"],
)
def test_release_matches_the_published_table(fmu, options, bounds):
    table = np.array([[float(v) for v in row.split()] for row in RELEASE_TABLE.split("\n")[1:-1]])
    equal = Inputs.constant([1000.0] * 4)
    values = input_values(equal) | {"x": 0.1, "y": 0.1, "phi": 0.1}
    with fmu.instance(values=values | options) as instance:
        found = instance.run(equal, table[:, 0], steps=np.arange(1, 500) / 10)
    for column, name in enumerate(POSE, start=1):
        assert found[name] == pytest.approx(table[:, column], abs=bounds[0]), name
    for i in range(4):
        length, tension = found[f"unstretched_length[{i + 1}]"], found[f"tension[{i + 1}]"]
        assert length == pytest.approx(table[:, 4 + i], rel=bounds[1])
        assert tension == pytest.approx(table[:, 8 + i], rel=bounds[2])


@pytest.mark.parametrize("seed", range(3))
@pytest.mark.parametrize("model", CABLE_MODELS)
def test_random_cases(fmu, model, seed):
    case = random_case(seed, model)
    t = case.grid()
    with fmu.instance(start=False) as instance:
        found = fmu_run(case, instance, t, steps=np.arange(1, 40) / 40 * case.end)
    assert_close(found, reference_run(case, t))


@pytest.mark.parametrize("inertia", ["reeled", "none"])
@pytest.mark.parametrize("model", CABLE_MODELS)
def test_other_cable_inertias(pack, model, inertia):
    case = random_case(11, model, inertia)
    t = case.grid(9)
    with pack(case.parameters).instance(start=False) as instance:
        found = fmu_run(case, instance, t, through_fmi=False)
    assert_close(found, reference_run(case, t))


@pytest.mark.parametrize("model", CABLE_MODELS)
def test_variable_communication_steps(fmu, model):
    case = random_case(21, model)
    t = np.cumsum(np.random.default_rng(5).choice([1e-4, 0.003, 0.02, 0.11, 0.5], 25))
    t = np.concatenate([[0.0], t[t < case.end]])
    with fmu.instance(start=False) as instance:
        found = fmu_run(case, instance, t)
    assert_close(found, reference_run(case, t))


@pytest.mark.parametrize("model", CABLE_MODELS)
def test_trajectory_does_not_depend_on_the_step_size(fmu, model):
    case = random_case(31, model)
    # Inputs that change on communication points of all three step sizes.
    case = replace(case, inputs=Inputs(np.round(case.inputs.times, 1), case.inputs.values))
    t = np.round(np.arange(round(case.end * 10) + 1) / 10, 1)
    runs = {}
    for size in (1e-3, 1e-2, 1e-1):
        with fmu.instance(start=False) as instance:
            steps = np.arange(1, round(case.end / size)) * size
            runs[size] = fmu_run(case, instance, t, steps=np.round(steps, 9))
    assert_close(runs[1e-3], runs[1e-1])
    assert_close(runs[1e-2], runs[1e-1])
    assert_close(runs[1e-1], reference_run(case, t))


@pytest.mark.parametrize("model", CABLE_MODELS)
def test_slack_cables(fmu, model):
    """One cable let go and pulled tight again, one lazily following."""
    case = random_case(41, model)
    forces = np.full((4, 7), 0.0)
    forces[:, :4] = 8000.0
    forces[1, 3] = forces[2, 1] = 0.0
    forces[2, 2] = -300.0
    case = replace(case, inputs=Inputs(np.array([0.0, 0.2, 0.4, 0.65]) * case.end, forces))
    t = case.grid(81)
    with fmu.instance(start=False) as instance:
        found = fmu_run(case, instance, t)
        flags = instance.slave.getBoolean(fmu.references(SLACK))
    assert [bool(f) for f in flags] == [found[f"tension[{i}]"][-1] == 0.0 for i in range(1, 5)]
    expected = reference_run(case, t)
    tension = np.array([found[f"tension[{i}]"] for i in range(1, 5)])
    assert tension.min() == 0.0
    assert_close(found, expected)


def test_slack_flag_tells_a_cable_without_tension(fmu):
    equal = [8000.0, 8000.0, 8000.0, 0.0]
    values = input_values(Inputs.constant(equal)) | {"x": 2.0, "cable_model": "rigid"}
    with fmu.instance(values=values) as instance:
        instance.step(0.5)
        tension = instance.get([f"tension[{i}]" for i in range(1, 5)])
        flags = instance.slave.getBoolean(fmu.references(SLACK))
    assert [bool(f) for f in flags] == [t == 0.0 for t in tension]


@pytest.mark.parametrize("solver", ["dormand_prince", "auto"])
@pytest.mark.parametrize("model", CABLE_MODELS)
def test_explicit_solvers_agree_with_the_reference(fmu, model, solver):
    case = random_case(61, model)
    t = case.grid()
    with fmu.instance(start=False) as instance:
        found = fmu_run(case, instance, t, solver=solver)
    assert_close(found, reference_run(case, t))


@pytest.mark.parametrize("model", CABLE_MODELS)
def test_input_derivatives_make_linear_inputs(fmu, model):
    case = random_case(51, model)
    slopes = np.random.default_rng(6).uniform(-1, 1, (6, 7)) * 800.0
    case = replace(case, inputs=Inputs(case.inputs.times, case.inputs.values, slopes))
    t = case.grid()
    with fmu.instance(start=False) as instance:
        # Several communication steps per ramp: the ramp goes on until the input is set again.
        found = fmu_run(case, instance, t, steps=np.arange(1, 20) / 20 * case.end)
    assert_close(found, reference_run(case, t))


@pytest.mark.parametrize("model", CABLE_MODELS)
def test_parameters_through_fmi_equal_those_of_the_model_file(fmu, pack, model):
    case = random_case(91, model)
    t = case.grid(9)
    with fmu.instance(start=False) as instance:
        through_fmi = fmu_run(case, instance, t)
    with pack(case.parameters).instance(start=False) as instance:
        from_file = fmu_run(case, instance, t, through_fmi=False)
    for name in OUTPUTS:
        assert np.array_equal(through_fmi[name], from_file[name]), name


def test_tighter_tolerance_comes_closer(fmu):
    case: Case = random_case(101, LUMPED_MASS)
    t = case.grid(5)
    expected = reference_run(case, t)
    errors = []
    for tolerance in (1e-4, 1e-11):
        with fmu.instance(start=False) as instance:
            found = fmu_run(case, instance, t, relative_tolerance=tolerance)
        errors.append(np.max(np.abs(found["x"] - expected["x"])))
    assert errors[1] < 1e-9
    assert errors[1] < errors[0]


def test_tolerance_of_the_experiment_is_the_default_for_the_integrator(fmu):
    """A host's tolerance has the same effect as the parameter."""
    case = random_case(102, LUMPED_MASS)
    t = case.grid(5)
    plant = Plant(case.parameters)
    _, values = starting(case, plant)
    values |= start_values(case.parameters)
    runs = []
    for options, experiment in (({"relative_tolerance": 1e-4}, {}), ({}, {"tolerance": 1e-4})):
        with fmu.instance(values=values | options, **experiment) as instance:
            runs.append(instance.run(case.inputs, t)["x"])
    assert np.array_equal(*runs)
