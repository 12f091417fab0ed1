"""The laws of real machines in the suite's plant, each against its closed form."""

import numpy as np
import pytest

from . import parameters, trial
from .cases import effect, outside
from .cases_machine import MACHINE
from .control import play, seen
from .plant import at_rest, derivative, lengths, state_count, winch_loss
from .robot import TELESCOPE

AT = (12.0, -8.0, 0.05)


def evaluated(hidden, forces, pose=AT):
    """Accelerations and tensions at rest under these winch forces."""
    params = parameters.build(hidden)
    command = np.asarray(forces, float)
    y = at_rest(params, 0.0, np.asarray(pose, float), command)
    rates, tension = np.zeros(state_count(params)), np.empty(4)
    derivative(params, 0.0, y, command, np.zeros(3), rates, tension)
    return params, y, rates, tension


def test_a_drum_off_its_axis_pays_out_the_sum_of_its_levers():
    drum = {"eccentricity": 0.02, "drum_radius": 0.3, "phase": 0.9}
    counted = np.linspace(0.0, 4.0, 4001)
    angle = counted / 0.3
    lever = 0.3 + 0.02 * np.sin(angle + 0.9)
    paid_out = np.concatenate([[0.0], np.cumsum(0.5 * np.diff(angle) * (lever[1:] + lever[:-1]))])
    np.testing.assert_allclose(trial.counted(paid_out, drum), counted, atol=1e-7)


def test_half_of_a_uniform_wind_on_a_cable_comes_to_the_platform():
    still = evaluated([], [20e3] * 4)
    wind = {"wind_x": 7.0, "wind_y": -4.0, "drag_area_per_length": 0.02}
    blown = evaluated([effect("cable_wind", **wind)], [20e3] * 4)
    force = np.zeros(2)
    for ax, ay, bx, by in np.column_stack([TELESCOPE.anchors, TELESCOPE.attachments]):
        c, s = np.cos(AT[2]), np.sin(AT[2])
        along = np.array([AT[0] + c * bx - s * by - ax, AT[1] + s * bx + c * by - ay])
        normal = np.array([-along[1], along[0]]) / np.linalg.norm(along)
        across = normal @ [7.0, -4.0]
        pressure = 0.5 * 1.225 * 0.02 * abs(across) * across
        force += 0.5 * pressure * np.linalg.norm(along) * normal
    # The platform carries a part of the cables across, which takes its share of the force.
    mass = TELESCOPE.mass + 4.0 / 3.0 * 0.5 * TELESCOPE.density * TELESCOPE.usual_length
    found = blown[2][3:5] - still[2][3:5]
    np.testing.assert_allclose(found, force / mass, rtol=0.02)


def test_wind_that_grows_with_height_is_stronger_on_upper_cables():
    wind = {"wind_x": 7.0, "wind_y": 0.0, "drag_area_per_length": 0.02}
    profile = {"exponent": 0.15, "ground": -900.0, "reference_height": 900.0}
    even, growing = (
        evaluated([effect("cable_wind", **wind, **more)], [20e3] * 4, (0.0, 0.0, 0.0))[2]
        for more in ({}, profile)
    )
    # The same at the middle's height; above it more, below it less, so that the platform turns.
    assert growing[3] == pytest.approx(even[3], rel=0.05)
    assert abs(growing[5]) > 1e-7 > abs(even[5])


def test_wrap_friction_is_eulers_ratio_either_way():
    values = {"friction": 0.1, "wrap_angle": 2.0, "transition_speed": 1e-3}
    params = parameters.build([effect("pulley_wrap_friction", 4, **values)])
    for speed, ratio in ((1.0, np.exp(0.2)), (-1.0, np.exp(-0.2)), (0.0, 1.0)):
        loss, _ = winch_loss(params, 3, speed, 5e3, 0.0)
        assert 5e3 + loss == pytest.approx(5e3 * ratio)


def test_asymmetric_friction_has_a_level_for_each_direction():
    values = {"force": 180.0, "transition_speed": 0.02, "asymmetry": 0.3}
    params = parameters.build([effect("winch_coulomb_friction", 2, law="tanh", **values)])
    levels = [winch_loss(params, 1, speed, 2e4, 0.0)[0] for speed in (1.0, -1.0)]
    assert levels == pytest.approx([180.0 * 1.3, -180.0 * 0.7])


def test_a_mast_that_gives_and_a_ripple_are_in_balance_at_rest():
    ripple = effect("winch_torque_ripple", 2, amplitude=60.0, period=1.3, phase=0.5)
    mast = effect("anchor_compliance", 2, stiffness=2.5e5)
    params, y, rates, tension = evaluated([mast, ripple], [20e3] * 4)
    assert np.abs(rates[10:14]).max() < 1e-3, "no winch moves"
    free, chord = y[7], np.empty(4)
    lengths(params, np.asarray(AT), chord)
    wave = 60.0 * np.sin(2.0 * np.pi * free / 1.3 + 0.5)
    assert tension[1] == pytest.approx(20e3 + wave, abs=1e-3)
    stretched = free * (1.0 + tension[1] / TELESCOPE.stiffness) + tension[1] / 2.5e5
    assert stretched == pytest.approx(chord[1], abs=1e-9)


def test_a_rope_that_rubs_settles_on_its_level_either_way():
    params = parameters.build([effect("cable_hysteresis", 1, force=120.0, yield_strain=1e-4)])
    y = at_rest(params, 0.0, np.asarray(AT, float), np.full(4, 20e3))
    ropes, step = 6 + 5 * 4, 1e-3
    for way in (1.0, -1.0):
        rates, tension = np.zeros(state_count(params)), np.empty(4)
        y[10] = way * 0.05  # the first winch pays out, so that its cable is strained less
        for _ in range(20_000):
            derivative(params, 0.0, y, np.full(4, 20e3), np.zeros(3), rates, tension)
            y[ropes] += step * rates[ropes]
        assert y[ropes] == pytest.approx(-way, abs=1e-3)
        assert not np.abs(y[ropes + 1 : ropes + 4]).any()
        before = tension[0]
        y[ropes] = 0.0
        derivative(params, 0.0, y, np.full(4, 20e3), np.zeros(3), rates, tension)
        assert before - tension[0] == pytest.approx(-way * 120.0, abs=0.2)


def test_a_pose_is_seen_in_a_turned_frame_of_another_scale_at_the_mark():
    pose, frame = np.array([3.0, -2.0, 0.1]), np.array([0.3, 0.8, -0.5, 0.02])
    mark = complex(3.0, -2.0) + complex(0.8, -0.5) * np.exp(0.1j)
    expected = 1.02 * mark * np.exp(-0.3j)
    assert seen(pose, frame) == pytest.approx([expected.real, expected.imag, 0.1 - 0.3])


def test_a_cable_pulls_along_the_gradient_of_its_length_round_a_pulley():
    # 30 m, so that it is more than an anchor beside itself.
    params = parameters.build([effect("pulley_radius", 2, radius=30.0)])
    pose, step = np.array([12.0, -8.0, 0.05]), 1e-3
    forces = np.full(4, 20e3)
    y = at_rest(params, 0.0, pose, forces)
    rates, tension = np.zeros(state_count(params)), np.empty(4)
    before = np.zeros(3)
    for sign, pull in ((1.0, 20e3), (-1.0, 19e3)):
        y[7] = at_rest(params, 0.0, pose, np.array([20e3, pull, 20e3, 20e3]))[7]
        derivative(params, 0.0, y, forces, np.zeros(3), rates, tension)
        before += sign * rates[3:6]
    # The same of a force on the platform along the gradient.
    gradient = np.empty(3)
    for axis in range(3):
        ends = np.empty((2, 4))
        for k, way in enumerate((step, -step)):
            moved = pose.copy()
            moved[axis] += way
            lengths(params, moved, ends[k])
        gradient[axis] = (ends[0, 1] - ends[1, 1]) / (2.0 * step)
    after = np.zeros(3)
    for sign, force in ((1.0, -1e3 * gradient), (-1.0, np.zeros(3))):
        derivative(params, 0.0, y, forces, force, rates, tension)
        after += sign * rates[3:6]
    np.testing.assert_allclose(before, after, rtol=1e-5, atol=1e-9)


@pytest.mark.parametrize("case", MACHINE, ids=lambda case: case.name)
def test_what_is_hidden_shows(case):
    """Each fault moves some reading of the open loop by more than its noise."""
    short = case.train[0].but(duration=10.0, lead_in=4.0)
    told, plain = (trial.run(short, effects) for effects in (case.effects, ()))
    moved = [
        np.abs(told.clean[name] - plain.clean[name]).max() / sigma
        for name, sigma in told.noise.items()
    ]
    assert max(moved) > 2.0, case.name


def test_a_winch_with_play_follows_a_half_width_behind():
    params = parameters.build([outside("winch_play", 2, width=200.0)])
    acting = np.full(4, 20e3)
    followed = []
    for command in (20e3, 20.05e3, 20.3e3, 20.15e3, 20.05e3):
        before = acting.copy()
        play(params, np.full(4, command), before, acting)
        followed.append(acting[1])
        assert acting[0] == command
    np.testing.assert_allclose(followed, [20e3, 20e3, 20.2e3, 20.2e3, 20.15e3])


def test_a_pendulum_takes_from_the_platform_what_it_gets():
    mass = 300.0
    hidden = [outside("pendulum", mass=mass, frequency=2.0, damping=0.02)]
    params = parameters.build(hidden)
    y = at_rest(params, 0.0, np.array(AT), np.full(4, 20e3))
    rates, tension = np.zeros(state_count(params)), np.empty(4)
    y[3] = 0.1
    first = len(y) - 4
    y[first : first + 2] = 0.05, 0.3
    derivative(params, 0.0, y, np.full(4, 20e3), np.zeros(3), rates, tension)
    force = mass * 2.0**2 * 0.05 + 2.0 * 0.02 * mass * 2.0 * (0.3 - 0.1)
    np.testing.assert_allclose(rates[first : first + 2], [0.3 - 0.1, -force / mass])


def test_the_platform_rubs_beyond_the_edge_only():
    hidden = [outside("rubbing", force=120.0, edge=1.0)]
    moves = []
    for x in (0.0, 2.0):
        found = []
        for law in ([], hidden):
            params = parameters.build(law)
            y = at_rest(params, 0.0, np.array([x, 0.0, 0.0]), np.full(4, 20e3))
            y[3] = 0.5
            rates, tension = np.zeros(state_count(params)), np.empty(4)
            derivative(params, 0.0, y, np.full(4, 20e3), np.zeros(3), rates, tension)
            found.append(rates[3])
        moves.append(found[1] - found[0])
    assert abs(moves[0]) < 1e-12
    assert -120.0 / TELESCOPE.mass < moves[1] < -0.8 * 120.0 / TELESCOPE.mass
