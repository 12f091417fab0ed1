"""How a run begins."""

from __future__ import annotations

import numpy as np
import pytest
from fmpy.fmi1 import FMICallException

from outside.cases import random_case, starting
from outside.fmu import POSE, TWIST, indexed, input_values, start_values
from reference.parameters import CABLE_MODELS, LUMPED_MASS, MASSLESS_SPRING, Inputs, Parameters
from reference.plant import Plant

FORCES = [7000.0, 8000.0, 9000.0, 8500.0]


@pytest.mark.parametrize("model", CABLE_MODELS)
def test_from_winch_forces_every_spring_carries_its_force(fmu, model):
    values = input_values(Inputs.constant(FORCES)) | {
        "cable_model": model,
        "x": 5.0,
        "y": -7.0,
        "phi": 0.2,
    }
    plant = Plant(Parameters(cable_model=model))
    expected = plant.initial_state((5.0, -7.0, 0.2), command=FORCES)
    with fmu.instance(values=values) as instance:
        assert instance.get(POSE).tolist() == [5.0, -7.0, 0.2]
        assert instance.get(TWIST).tolist() == [0.0] * 3
        if plant.has_length:
            assert instance.get(indexed("unstretched_length")) == pytest.approx(
                expected[6:10], rel=1e-14
            )
        if model == LUMPED_MASS:
            assert instance.get(indexed("tension")) == pytest.approx(FORCES, rel=1e-8)


@pytest.mark.parametrize("model", CABLE_MODELS)
def test_from_states_takes_what_is_set(fmu, model):
    case = random_case(2, model)
    y0, values = starting(case, Plant(case.parameters))
    with fmu.instance(values=values | start_values(case.parameters)) as instance:
        assert instance.get([*POSE, *TWIST]).tolist() == y0[:6].tolist()
        if model != "rigid":
            assert instance.get(indexed("unstretched_length")).tolist() == y0[6:10].tolist()
        if model == LUMPED_MASS:
            assert instance.get(indexed("unstretched_length_rate")).tolist() == y0[10:14].tolist()


@pytest.mark.parametrize("model", [MASSLESS_SPRING, LUMPED_MASS])
def test_static_equilibrium_stays_where_it_is(fmu, model):
    """Equal forces hold the platform at the centre; a push moves it to where the cables' angles
    balance the push."""
    inputs = Inputs.constant([20000.0] * 4, (300.0, -200.0, 0.0))
    values = input_values(inputs) | {"initialization": "static_equilibrium", "cable_model": model}
    with fmu.instance(values=values) as instance:
        start = instance.get([*POSE, *TWIST, *indexed("tension")])
        rates = instance.get([f"der({n})" for n in (*TWIST, *indexed("unstretched_length"))])
        instance.step(1.0)
        after = instance.get([*POSE, *TWIST, *indexed("tension")])
    assert np.abs(start[:2]).min() > 1.0
    assert start[6:] == pytest.approx([20000.0] * 4, rel=1e-8)
    assert np.abs(rates).max() < 1e-9
    assert after == pytest.approx(start, rel=1e-6, abs=1e-6)
    plant = Plant(Parameters(cable_model=model))
    y0 = plant.initial_state(start[:3], command=inputs.at(0.0)[:4])
    acceleration = plant.evaluate(0.0, y0, inputs.at(0.0)[:4], inputs.at(0.0)[4:])[0][3:6]
    assert np.abs(acceleration).max() < 1e-9


def test_static_equilibrium_fails_where_there_is_none(fmu):
    """Slack cables hold nothing against a push."""
    inputs = Inputs.constant([0.0] * 4, (1000.0, 0.0, 0.0))
    values = input_values(inputs) | {"initialization": "static_equilibrium"}
    with fmu.instance(start=False) as instance:
        instance.begin(values)
        with pytest.raises(FMICallException) as failure:
            instance.slave.exitInitializationMode()
        assert failure.value.status == 3
        instance.slave.reset()
        instance.initialise({"initialization": "from_winch_forces"})
        instance.step(0.1)


def test_a_run_may_begin_at_any_time(fmu):
    values = input_values(Inputs.constant(FORCES)) | {"x": 5.0}
    ends = []
    for begin in (0.0, 1000.0, -250.0):
        with fmu.instance(values=values, start_time=begin) as instance:
            for _ in range(10):
                instance.step(0.125)
            ends.append(instance.get([*POSE, *TWIST, *indexed("tension")]))
    assert ends[1] == pytest.approx(ends[0], rel=1e-9, abs=1e-12)
    assert ends[2] == pytest.approx(ends[0], rel=1e-9, abs=1e-12)


def test_start_values_may_be_set_in_initialisation_mode(fmu):
    values = input_values(Inputs.constant(FORCES)) | {"x": 5.0, "platform_mass": 2700.0}
    snapshots = []
    with fmu.instance(values=values) as instance:
        instance.step(0.5)
        snapshots.append(instance.snapshot())
    with fmu.instance(start=False) as instance:
        instance.begin()
        instance.set(values)
        instance.slave.exitInitializationMode()
        instance.step(0.5)
        snapshots.append(instance.snapshot())
    assert np.array_equal(*snapshots)


@pytest.mark.parametrize(
    "values",
    [
        {"platform_mass": -1.0},
        {"platform_inertia": 0.0},
        {"cable_area": -4e-4},
        {"anchor_radius": -900.0},
        {"x": 5000.0},
        {"relative_tolerance": -1e-6},
        {"initialization": "from_states", "unstretched_length[2]": -3.0},
    ],
    ids=lambda values: " ".join(values),
)
def test_impossible_values_are_refused(fmu, values):
    with fmu.instance(start=False) as instance:
        with pytest.raises(FMICallException) as failure:
            instance.initialise(values)
        assert failure.value.status in (2, 3)
        instance.slave.reset()
        instance.initialise()
        instance.step(0.1)
