"""Winches that are told torques, speeds and lengths, against the independent model."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from outside.cases import Case, assert_close, fmu_run, random_case, reference_run, starting
from outside.fmu import indexed, input_names, output_names
from outside.test_any_cables import random_robot
from reference.parameters import CABLE_MODELS, LUMPED_MASS, Effect, Inputs
from reference.plant import Plant

WINCH = {"drum_radius": 0.4, "gear_ratio": 3.0, "rotor_inertia": 0.6}
SERVO = {"bandwidth": 12.0, "damping": 0.6}


def driven(case: Case, command: str, **winch) -> Case:
    """The same motion under another kind of command: as large, and as sudden."""
    winch = WINCH | winch | {"command": command}
    case = replace(case, parameters=replace(case.parameters, winch=winch))
    plant = Plant(case.parameters)
    n = plant.cables
    values = case.inputs.values.copy()
    # Between -1 and 1 for forces of 6 to 12 kN.
    size = (values[:, :n] - 9000.0) / 3000.0
    match command:
        case "torque":
            values[:, :n] /= plant.gearing
        case "speed":
            values[:, :n] = 0.3 * size
        case "length":
            y0 = plant.initial_state(case.pose, case.twist, command=np.zeros(n))
            values[:, :n] = y0[plant.lengths] + 0.1 * size
    return replace(case, inputs=Inputs(case.inputs.times, values))


@pytest.mark.parametrize("model", CABLE_MODELS)
def test_torques_move_the_platform_as_in_the_independent_model(pack, model):
    case = driven(random_case(31, model), "torque")
    t = case.grid(9)
    with pack(case.parameters).instance(start=False) as instance:
        found = fmu_run(case, instance, t, through_fmi=False)
    assert_close(found, reference_run(case, t))


@pytest.mark.parametrize("command", ["speed", "length"])
@pytest.mark.parametrize("limit", [5e4, 9.5e3], ids=["free", "limited"])
def test_servos_move_the_platform_as_in_the_independent_model(pack, command, limit):
    case = driven(random_case(32, LUMPED_MASS), command, **SERVO, force_limit=limit)
    t = case.grid(9)
    # The force has a corner at its limit, which costs the integrator some digits.
    options = {} if limit > 2e4 else {"relative_tolerance": 1e-11}
    with pack(case.parameters).instance(start=False) as instance:
        found = fmu_run(case, instance, t, through_fmi=False, **options)
    expected = reference_run(case, t)
    assert max(expected[f"tension[{i}]"].max() for i in range(1, 5)) > 9e3
    assert_close(found, expected)


@pytest.mark.parametrize("command", ["torque", "length"])
def test_winches_of_their_own_on_six_cables(pack, command):
    rng = np.random.default_rng(33)
    robot = random_robot(rng, 6, LUMPED_MASS)
    own = [{"drum_radius": 0.3}, {"gear_ratio": 4.0}, {"rotor_inertia": 1.5}] * 2
    cables = [replace(c, own=c.own | o) for c, o in zip(robot.cable, own, strict=True)]
    inputs = np.hstack([rng.uniform(6e3, 12e3, (3, 6)), rng.uniform(-300.0, 300.0, (3, 3))])
    start = ((2.0, -1.0, 0.05), (0.3, 0.2, -0.01))
    robot = replace(robot, cable=tuple(cables))
    case = driven(Case(robot, *start, Inputs([0.0, 0.7, 1.1], inputs), 2.0), command, **SERVO)
    t = case.grid(9)
    with pack(case.parameters).instance(start=False) as instance:
        found = fmu_run(case, instance, t, through_fmi=False)
    names = output_names(6)
    assert_close(found, reference_run(case, t), names=names)


def test_what_lies_between_a_servo_and_its_cable(pack):
    """Dead time and lag, and friction that the servo does not know of."""
    effects = (
        Effect("winch_delay", 2, {"delay": 0.113}),
        Effect("winch_lag", None, {"time_constant": 0.02}),
        Effect("winch_viscous_friction", None, {"coefficient": 200.0}),
        Effect("cable_stiffening", None, {"coefficient": 1e5}),
    )
    case = driven(random_case(34, LUMPED_MASS, effects=effects), "length", **SERVO)
    t = case.grid(9)
    with pack(case.parameters).instance(start=False) as instance:
        found = fmu_run(case, instance, t, through_fmi=False)
    assert_close(found, reference_run(case, t))


@pytest.mark.parametrize("command", ["torque", "speed", "length"])
def test_derivatives_by_commands_equal_differences(pack, command):
    case = driven(random_case(35, LUMPED_MASS), command, **SERVO)
    plant = Plant(case.parameters)
    y0, values = starting(case, plant)
    u0 = case.inputs.at(0.0)
    knowns = input_names(4, command)[:4]
    unknowns = ["ax", "ay", "alpha", *(f"der({n})" for n in indexed("unstretched_length_rate"))]
    with pack(case.parameters).instance(values=values) as instance:
        refs = instance.fmu.references
        found = np.column_stack(
            [
                instance.slave.getDirectionalDerivative(refs(unknowns), refs([name]), [1.0])
                for name in knowns
            ]
        )
    step = {"torque": 1.0, "speed": 1e-2, "length": 1e-2}[command]
    columns = []
    for k in range(4):
        ends = []
        for sign in (1.0, -1.0):
            u = u0.copy()
            u[k] += sign * step
            rates = plant.evaluate(0.0, y0, u[:4], u[4:])[0]
            ends.append(np.concatenate([rates[3:6], rates[10:14]]))
        columns.append((ends[0] - ends[1]) / (2.0 * step))
    expected = np.column_stack(columns)
    assert np.abs(expected[3:]).max() > 0.0
    assert found == pytest.approx(expected, rel=1e-6, abs=1e-9)


def test_simulate_and_inverse_speak_the_models_language(cdpr, tmp_path):
    model = tmp_path / "model.toml"
    model.write_text('[winch]\ncommand = "length"\nbandwidth = 30.0\n')
    move = tmp_path / "move.csv"
    move.write_text("time,x,y,phi\n0,0,0,0\n10,5,2,0.02\n20,8,0,0\n")
    table, start = tmp_path / "lengths.csv", tmp_path / "start.toml"
    cdpr("inverse", "--model", model, "--trajectory", move, "--ends", "rest", "--step", "0.01",
         "--held", "-o", table, "--start", start)  # fmt: skip
    assert table.read_text().startswith("time,winch_length[1],winch_length[2]")
    out = tmp_path / "run.csv"
    cdpr("simulate", "--model", start, "--input", table, "-o", out)
    rows = out.read_text().splitlines()
    end = dict(zip(rows[0].split(","), map(float, rows[-1].split(",")), strict=True))
    # Lengths held over 10 ms lag by half a step; the robot arrives where it was to be.
    assert (end["x"], end["y"], end["phi"]) == pytest.approx((8.0, 0.0, 0.0), abs=2e-4)
    assert end["winch_angle[1]"] == pytest.approx(end["unstretched_length[1]"] / 0.5)
    forces = tmp_path / "forces.csv"
    forces.write_text(
        "time,winch_force[1],winch_force[2],winch_force[3],winch_force[4]\n0,1,1,1,1\n"
    )
    refused = cdpr("simulate", "--model", model, "--input", forces, "-o", out, ok=False)
    assert refused.returncode == 2
    assert "winch_length[1]" in refused.stderr
