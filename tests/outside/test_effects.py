"""Every effect of the catalogue: the FMU against the independent model extended by it."""

from __future__ import annotations

import functools
import json
from dataclasses import replace

import pytest

from outside.cases import (
    CATALOGUE,
    EFFECTS,
    FIRST_EFFECTS,
    Case,
    assert_close,
    fmu_run,
    random_case,
    reference_run,
    starting,
)
from outside.fmu import Fmu
from reference.parameters import (
    CABLE_MODELS,
    LUMPED_MASS,
    MASSLESS_SPRING,
    RIGID,
    Effect,
    Parameters,
)
from reference.plant import Plant


def test_the_catalogue_here_is_the_product_s(cdpr):
    listed = {entry["id"] for entry in json.loads(cdpr("effects", "--json").stdout)}
    assert set(CATALOGUE) == listed


def creep_at_the_start(fmu: Fmu, case: Case) -> list[float]:
    """The FMU chooses it: how long a cable has been loaded is not among its start values."""
    plant = Plant(case.parameters)
    if not plant.creeps:
        return []
    _, values = starting(case, plant)
    with fmu.instance(values=values) as instance:
        return list(
            instance.get([f"effect.cable_creep[{i + 1}].state" for i, _, _ in plant.creeps])
        )


@functools.cache
def without_effects(count: int) -> dict:
    """The case of one effect without it, at so many times: the same whatever the effect."""
    case = random_case(61, LUMPED_MASS)
    return reference_run(case, case.grid(count))


@pytest.mark.parametrize(
    ("name", "model"),
    [
        *((name, LUMPED_MASS) for name in CATALOGUE),
        *((name, RIGID) for name in CATALOGUE),
        *((name, MASSLESS_SPRING) for name in FIRST_EFFECTS),
    ],
)
def test_one_effect(pack, name, model):
    case = random_case(61, model, effects=(CATALOGUE[name],))
    count = 41 if name == "pose_sensor_delay" else 9
    t = case.grid(count)
    fmu = pack(case.parameters)
    with fmu.instance(start=False) as instance:
        # Equations are compared: at a kink, as of a power limit, a solver errs by more than told.
        found = fmu_run(case, instance, t, through_fmi=False, relative_tolerance=1e-11)
    expected = reference_run(case, t, creep_at_the_start(fmu, case))
    assert_close(found, expected)
    if model == LUMPED_MASS:  # the effect is not too small to be seen here
        with pytest.raises(AssertionError):
            assert_close(expected, without_effects(count), tolerance=1e-5)


@pytest.mark.parametrize("model", [LUMPED_MASS, RIGID])
def test_effects_that_begin_and_end(pack, model):
    times = {
        "winch_coulomb_friction": {"from": 0.43},
        "anchor_offset": {"until": 2.017},
        "platform_mass": {"from": 0.9, "until": 1.7},
        "length_sensor_scale": {"from": 1.234},
    }
    effects = [CATALOGUE[name] for name in times]
    plain = ("force", "transition_speed", "tail", "asymmetry")
    shape = {key: effects[0].values[key] for key in plain}
    effects[0] = replace(effects[0], values=shape)
    effects = tuple(replace(e, values=e.values | times[e.id]) for e in effects)
    case = random_case(63, model, effects=effects)
    t = case.grid(9)
    with pack(case.parameters).instance(start=False) as instance:
        found = fmu_run(case, instance, t, through_fmi=False)
    assert_close(found, reference_run(case, t))


@pytest.mark.parametrize(
    ("target", "expression"),
    [
        ("platform.force_y", "120*tanh(vx) - 3*x^2"),
        ("platform.torque", "-4e3*omega*cos(phi) + 500*exp(-time)"),
    ],
)
def test_expressions_of_all_targets(pack, target, expression):
    effect = Effect("expression", None, {"target": target, "expression": expression})
    case = random_case(62, LUMPED_MASS, effects=(effect,))
    t = case.grid(9)
    with pack(case.parameters).instance(start=False) as instance:
        found = fmu_run(case, instance, t, through_fmi=False)
    assert_close(found, reference_run(case, t))


@pytest.mark.parametrize("model", CABLE_MODELS)
def test_all_effects_together(pack, model):
    case = random_case(71, model, effects=tuple(EFFECTS.values()))
    t = case.grid(9)
    with pack(case.parameters).instance(start=False) as instance:
        found = fmu_run(case, instance, t, through_fmi=False)
    assert_close(found, reference_run(case, t))


def test_effect_parameters_can_be_set_through_fmi(pack):
    named = pack(Parameters(effects=tuple(EFFECTS.values())))
    case = random_case(81, LUMPED_MASS, effects=tuple(EFFECTS.values()))
    changed, values = [], {}
    for effect in EFFECTS.values():
        doubled = {key: 2.0 * value for key, value in effect.values.items()}
        changed.append(replace(effect, values=doubled))
        place = "" if effect.cable is None else f"[{effect.cable}]"
        values |= {f"effect.{effect.id}{place}.{key}": v for key, v in doubled.items()}
    case = replace(case, parameters=replace(case.parameters, effects=tuple(changed)))
    t = case.grid(9)
    with named.instance(start=False) as instance:
        found = fmu_run(case, instance, t, **values)
    assert_close(found, reference_run(case, t))
