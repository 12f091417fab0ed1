"""Calls whose work would get nowhere end, and the instance lives on."""

from __future__ import annotations

import math
from ctypes import byref, c_double

import pytest
from fmpy.fmi2 import fmi2LastSuccessfulTime

EXPRESSION = '[[effect]]\nid = "expression"\ntarget = "{}"\nexpression = "{}"\n'
CREEP = '[[effect]]\nid = "cable_creep"\naxial_stiffness = 1.0\ntime_constant = 10.0\n'


def reached(instance) -> float:
    """The time up to which the instance came in a step that it gave up."""
    value = c_double()
    instance.slave.fmi2GetRealStatus(instance.slave.component, fmi2LastSuccessfulTime, byref(value))
    return value.value


@pytest.mark.parametrize(
    ("model", "values", "step"),
    [
        (EXPRESSION.format("winch[1]", "1e26*sin(time)"), {}, 0.01),
        (None, {"disturbance_torque": 1e9}, 2.0),
    ],
    ids=["a winch of 1e26 N", "a torque of 1e9 N m"],
)
def test_a_step_whose_work_gets_nowhere_is_discarded(pack, model, values, step):
    with pack(model).instance() as instance:
        instance.set(values)
        with pytest.raises(Exception, match="fmi2DoStep"):
            instance.step(step)
        assert 0.0 <= reached(instance) < step
        assert math.isfinite(instance.value("x"))


def test_dry_friction_written_as_a_sign_holds_the_platform(pack):
    with pack(EXPRESSION.format("platform.force_x", "-500*sign(vx)")).instance() as instance:
        instance.set({"disturbance_force_x": 400.0})
        for _ in range(100):
            instance.step(0.01)
        assert 0.0 < instance.value("vx") < 1e-5
        instance.set({"disturbance_force_x": 900.0})
        for _ in range(100):
            instance.step(0.01)
        assert instance.value("vx") > 0.05


def test_creep_in_a_spring_of_one_newton_gives_an_answer(pack):
    with pack(CREEP).instance() as instance:
        for _ in range(10):
            instance.step(0.1)
        assert math.isfinite(instance.value("tension[1]"))


def test_a_delayed_pose_at_3_6e14_seconds_gives_an_answer(pack):
    model = '[[effect]]\nid = "pose_sensor_delay"\ndelay = 0.1\n'
    with pack(model).instance(start_time=3.6e14) as instance:
        instance.slave.doStep(3.6e14, 1.0)
        assert math.isfinite(instance.value("x"))
