"""Derivatives, statics and inverse dynamics of robots of any number of cables, against the
independent model."""

from __future__ import annotations

import csv
import tomllib

import numpy as np
import pytest

from outside.cases import starting
from outside.fmu import POSE, TWIST, input_names, output_names
from outside.test_any_cables import random_case
from outside.test_derivatives import assert_same_matrix, jacobian, reference_differences
from reference.parameters import CABLE_MODELS, LUMPED_MASS, MASSLESS_SPRING, RIGID
from reference.plant import Plant

CABLES = [3, 4, 6, 8]
BOUNDS = ["--tension-min", 1000, "--tension-max", 20000]


def state_names(model: str, cables: int) -> list[str]:
    """The states of a model, in their order."""
    own = {RIGID: 0, MASSLESS_SPRING: 1, LUMPED_MASS: 2}[model]
    kinds = ("unstretched_length", "unstretched_length_rate")[:own]
    return [*POSE, *TWIST, *(f"{kind}[{i + 1}]" for kind in kinds for i in range(cables))]


@pytest.mark.parametrize("cables", CABLES)
@pytest.mark.parametrize("model", CABLE_MODELS)
def test_directional_derivatives_equal_the_reference_linearised(pack, model, cables):
    case = random_case(300 + cables, cables, model)
    y0, values = starting(case, Plant(case.parameters))
    states = state_names(model, cables)
    unknowns = [*output_names(cables), *(f"der({name})" for name in states)]
    knowns = [*states, *input_names(cables)]
    with pack(case.parameters).instance(values=values) as instance:
        found = jacobian(instance, unknowns, knowns)
    expected = reference_differences(case, y0, case.inputs.at(0.0), unknowns, knowns)
    assert_same_matrix(found, expected, unknowns, knowns, 1e-6)


@pytest.mark.parametrize("cables", [3, 6])
def test_derivatives_with_a_slack_cable_equal_the_reference_linearised(pack, cables):
    case = random_case(400 + cables, cables, LUMPED_MASS)
    y0, values = starting(case, Plant(case.parameters))
    # Ten metres more than the cable is long.
    y0[6 + 1] += 10.0
    values["unstretched_length[2]"] += 10.0
    states = state_names(LUMPED_MASS, cables)
    unknowns = [*output_names(cables), *(f"der({name})" for name in states)]
    knowns = [*states, *input_names(cables)]
    with pack(case.parameters).instance(values=values) as instance:
        assert instance.value("slack[2]")
        found = jacobian(instance, unknowns, knowns)
    expected = reference_differences(case, y0, case.inputs.at(0.0), unknowns, knowns)
    assert_same_matrix(found, expected, unknowns, knowns, 1e-6)


def wrench_for(plant: Plant, y, command, acceleration) -> np.ndarray:
    """The disturbance under which the platform has this acceleration."""

    def accelerated(wrench):
        return plant.evaluate(0.0, y, command, np.array(wrench))[0][3:6]

    free = accelerated([0.0, 0.0, 0.0])
    size = [1e3, 1e3, 1e4]
    columns = np.column_stack([(accelerated(np.diag(size)[k]) - free) / size[k] for k in range(3)])
    return np.linalg.solve(columns, acceleration - free)


def with_disturbance(parameters, wrench) -> str:
    """The model file with this disturbance in its start."""
    names = ("disturbance_force_x", "disturbance_force_y", "disturbance_torque")
    lines = "".join(f"{name} = {value!r}\n" for name, value in zip(names, wrench, strict=True))
    return parameters.to_toml().replace("[start]\n", f"[start]\n{lines}", 1)


@pytest.mark.parametrize("cables", CABLES)
@pytest.mark.parametrize("model", CABLE_MODELS)
def test_a_pose_held_at_rest_is_at_rest_in_the_independent_model(cdpr, tmp_path, model, cables):
    case = random_case(500 + cables, cables, model)
    plant = Plant(case.parameters)
    command = case.inputs.at(0.0)[:cables]
    resting = plant.initial_state(case.pose, command=command)
    wrench = wrench_for(plant, resting, command, np.zeros(3))
    file, hold = tmp_path / "model.toml", tmp_path / "hold.toml"
    file.write_text(with_disturbance(case.parameters, wrench.tolist()))
    pose = ",".join(repr(float(v)) for v in case.pose)
    cdpr("analyse", "--model", file, f"--pose={pose}", *BOUNDS, "--start", hold)
    start = tomllib.loads(hold.read_text())["start"]
    held = np.array(start["winch_force"])
    if cables == 3:
        np.testing.assert_allclose(held, command, rtol=1e-8)
    y = plant.initial_state(case.pose, unstretched=np.array(start["unstretched_length"]))
    rates, _, tension, *_ = plant.evaluate(0.0, y, held, wrench)
    np.testing.assert_allclose(tension, held, rtol=1e-6)
    assert np.abs(rates).max() < 1e-6


@pytest.mark.parametrize("cables", CABLES)
@pytest.mark.parametrize("model", [RIGID, LUMPED_MASS])
def test_forces_of_a_motion_make_it_in_the_independent_model(cdpr, tmp_path, model, cables):
    case = random_case(600 + cables, cables, model)
    plant = Plant(case.parameters)
    rigid = Plant(random_case(600 + cables, cables, RIGID).parameters)
    times = np.linspace(0.0, 4.0, 41)
    turn, size = np.array([0.8, 0.6, 0.5]), np.array([2.0, 1.5, 0.03])
    sines, cosines = [[wave(turn * t) for t in times] for wave in (np.sin, np.cos)]
    motions = [
        (size * s, size * turn * c, -size * turn**2 * s)
        for s, c in zip(sines, cosines, strict=True)
    ]
    # Forces of 8 kN and this disturbance make the motion with rigid cables.
    pull = np.full(cables, 8000.0)
    wrenches = [wrench_for(rigid, np.concatenate(m[:2]), pull, m[2]) for m in motions]
    header = ["time", *POSE, *TWIST, "ax", "ay", "alpha"]
    header += ["disturbance_force_x", "disturbance_force_y", "disturbance_torque"]
    move, file, table = (tmp_path / name for name in ("move.csv", "model.toml", "forces.csv"))
    with move.open("w", newline="") as out:
        rows = csv.writer(out)
        rows.writerow(header)
        for t, m, w in zip(times, motions, wrenches, strict=True):
            rows.writerow([repr(float(v)) for v in (t, *np.concatenate(m), *w)])
    file.write_text(case.parameters.to_toml())
    cdpr("inverse", "--model", file, "--trajectory", move, *BOUNDS, "--step", 0.002, "-o", table)
    with table.open(newline="") as text:
        found = [{name: float(v) for name, v in row.items()} for row in csv.DictReader(text)]

    def of_cables(row, name):
        return np.array([row[f"{name}[{i + 1}]"] for i in range(cables)])

    def evaluated(row):
        y = np.array([row[name] for name in (*POSE, *TWIST)])
        if model == LUMPED_MASS:
            own = [of_cables(row, f"unstretched_length{rate}") for rate in ("", "_rate")]
            y = np.concatenate([y, *own])
        wrench = [row[name] for name in input_names(cables)[cables:]]
        return plant.evaluate(0.0, y, of_cables(row, "winch_force"), wrench)

    for k in range(50, len(found) - 50, 50):
        rates, _, tension, *_ = evaluated(found[k])
        np.testing.assert_allclose(tension, of_cables(found[k], "tension"), rtol=1e-7)
        np.testing.assert_allclose(rates[3:6], motions[k // 50][2], rtol=1e-6, atol=1e-9)
        if model == RIGID and cables == 3:
            np.testing.assert_allclose(of_cables(found[k], "winch_force"), pull, rtol=1e-7)
        if model == LUMPED_MASS:
            # Between samples, where the disturbance has a second derivative.
            rates, *_ = evaluated(found[k + 25])
            ends = [of_cables(found[k + 25 + way], "unstretched_length_rate") for way in (1, -1)]
            along = (ends[0] - ends[1]) / 0.004
            np.testing.assert_allclose(rates[6 + cables :], along, atol=2e-4)
