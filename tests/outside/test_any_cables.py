"""Robots of other numbers of cables, in gravity, against the independent model."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np
import pytest

from outside.cases import Case, assert_close, fmu_run, reference_run
from outside.fmu import output_names
from reference.parameters import (
    CABLE_MODELS,
    LUMPED_MASS,
    MASSLESS_SPRING,
    Cable,
    Inputs,
    Parameters,
)


def random_robot(rng, cables: int, cable_model: str) -> Parameters:
    """Anchors around, attachments on the near side, some cables of their own, light gravity."""
    rows = []
    for i in range(cables):
        angle = 2.0 * math.pi * (i + rng.uniform(0.3, 0.7)) / cables
        on_body = angle + rng.uniform(-0.3, 0.3)
        far, near = rng.uniform(600.0, 900.0), 10.0
        own = {}
        if i % 2:
            own = {"density": rng.uniform(0.15, 0.3), "damping": rng.uniform(1e4, 4e4)}
        if i % 3 == 1:
            own |= {"youngs_modulus": rng.uniform(3e10, 5e10), "area": rng.uniform(3e-4, 5e-4)}
        anchor = (far * math.cos(angle), far * math.sin(angle))
        attachment = (near * math.cos(on_body), near * math.sin(on_body))
        rows.append(Cable(anchor, attachment, {k: float(v) for k, v in own.items()}))
    return Parameters(
        cable=tuple(rows),
        cable_model=cable_model,
        gravity=(0.2, -0.6),
        centre_of_mass=(0.4, -0.3),
    )


def random_case(seed: int, cables: int, cable_model: str) -> Case:
    """A robot on the move under forces that jump."""
    rng = np.random.default_rng(seed)
    # Massless springs have a pole near -760 1/s, slow work for the reference's explicit method.
    end = 0.6 if cable_model == MASSLESS_SPRING else 2.0
    knots = np.concatenate([[0.0], np.sort(rng.uniform(0.05, 0.95, 4)) * end])
    forces = rng.uniform(6000.0, 12000.0, (5, cables))
    wrench = rng.uniform(-1.0, 1.0, (5, 3)) * [400.0, 400.0, 3000.0]
    pose = (*rng.uniform(-5.0, 5.0, 2), rng.uniform(-0.1, 0.1))
    twist = (*rng.uniform(-1.0, 1.0, 2), rng.uniform(-0.02, 0.02))
    as_floats = [tuple(float(v) for v in vector) for vector in (pose, twist)]
    robot = random_robot(rng, cables, cable_model)
    return Case(robot, *as_floats, Inputs(knots, np.hstack([forces, wrench])), end)


@pytest.mark.parametrize("cables", [3, 4, 6, 8])
@pytest.mark.parametrize("model", CABLE_MODELS)
def test_a_robot_of_any_cables_moves_as_the_independent_model(pack, model, cables):
    case = random_case(100 * cables, cables, model)
    t = case.grid(9)
    with pack(case.parameters).instance(start=False) as instance:
        found = fmu_run(case, instance, t, through_fmi=False)
    assert_close(found, reference_run(case, t), names=output_names(cables))


@pytest.mark.parametrize("cables", [3, 6])
def test_slack_among_any_cables(pack, cables):
    case = random_case(7 + cables, cables, LUMPED_MASS)
    values = case.inputs.values.copy()
    values[1:3, 1] = 0.0
    case = replace(case, inputs=Inputs(case.inputs.times, values))
    t = case.grid(41)
    with pack(case.parameters).instance(start=False) as instance:
        found = fmu_run(case, instance, t, through_fmi=False)
    assert min(found[f"tension[{i}]"].min() for i in range(1, cables + 1)) == 0.0
    assert_close(found, reference_run(case, t), names=output_names(cables))
