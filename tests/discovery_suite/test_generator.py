"""The generator itself: its plant, its integrator, its sensors, its judge."""

import json
import tomllib
from dataclasses import replace

import numpy as np
import pytest

from . import moordyn_trial, parameters, suite, trial
from .cases import effect
from .control import distribute
from .generate import places, run_trial, truth, write_case
from .judge import judge, names, parameter_errors
from .plant import (
    at_rest,
    derivative,
    elastic_tension,
    lengths,
    replay,
    state_count,
    winch_loss,
)
from .robot import BENCH, EIGHT, FIELD, TELESCOPE
from .score import markdown, summary, truth_model
from .strength import strength

# Release from rest under 1000 N in each cable: t, x, y, phi, l1..l4, T1..T4, made elsewhere by a
# Dormand-Prince 8(5,3) integrator at 1e-12 on the nominal plant.
RELEASE = """
0 0.1 0.1 0.1 901.1354009 898.9960286 900.852594 898.9991587 1000 1000 1000 1000
1 0.09996146395 0.09995968337 0.1000568557 901.1359055 898.9954669 900.8532093 898.9985983
  1000.081074 999.90959 1000.094669 999.9095578
5 0.09903854427 0.09899415739 0.1014233341 901.1481507 898.9818407 900.8681242 898.9850023
  1000.055707 999.9428216 1000.068239 999.9432948
10 0.09617267687 0.09599688657 0.1057332615 901.1868182 898.9388839 900.9150799 898.9421384
  1000.086979 999.9020214 1000.10683 999.9028128
20 0.08498329362 0.08430780395 0.1235809352 901.3476993 898.7612063 901.1083041 898.7648046
  1000.125725 999.8635548 1000.145636 999.8638785
50 0.01818326125 0.01506077759 0.2778655904 902.758377 897.2470203 902.7113214 897.2519394
  1000.260172 999.7379766 1000.263891 999.737674
"""


def open_loop(params, pose, forces, seconds, dt=0.01, h=1e-3, start=None):
    """Times and states of a release under constant winch forces."""
    n = round(seconds / dt) + 1
    held = np.tile(np.asarray(forces, float), (n, 1))
    y0 = at_rest(params, 0.0, np.asarray(pose, float), held[0]) if start is None else start
    quiet = np.zeros((n + 1, 3))
    states = replay(params, 0.0, dt, h, y0, 0, n - 1, held, quiet[:n], quiet)
    return dt * np.arange(n), states


def tensions(params, states, forces):
    """Tensions of a run under constant forces."""
    out, rate = np.empty((len(states), 4)), np.zeros(state_count(params))
    for k, y in enumerate(states):
        derivative(params, 0.0, y, np.asarray(forces, float), np.zeros(3), rate, out[k])
    return out


def test_release_matches_the_reference_table():
    table = np.array(RELEASE.split(), float).reshape(-1, 12)
    params = parameters.build()
    _, states = open_loop(params, (0.1, 0.1, 0.1), [1000.0] * 4, 50.0)
    rows = states[np.round(table[:, 0] * 100).astype(int)]
    np.testing.assert_allclose(rows[:, :3], table[:, 1:4], rtol=0, atol=1e-10)
    np.testing.assert_allclose(rows[:, 6:10], table[:, 4:8], rtol=0, atol=1e-7)
    np.testing.assert_allclose(
        tensions(params, rows, [1000.0] * 4), table[:, 8:], rtol=0, atol=2e-6
    )


def test_energy_balance_without_dissipation():
    """Kinetic plus elastic energy changes by the work at the winches, and by nothing else.

    Cables without mass on heavy drums, an off-centre mass, springs without damping. Cable that is
    paid out takes the strain energy it carries through the drum: T^2 / (2 EA) per metre.
    """
    values = parameters.nominal()
    values.update(rho=0.0, bl=np.zeros(4), drum=np.full(4, 90.0), com_x=0.4, com_y=-0.3)
    params = parameters.freeze(values)
    pull = np.array([9e3, 10e3, 11e3, 10e3])
    start = at_rest(params, 0.0, np.array([2.0, -1.0, 0.05]), np.full(4, 10e3))
    start[3:6] = 0.5, -0.3, 0.02
    t, states = open_loop(params, None, pull, 20.0, dt=1e-3, start=start)
    phi, vx, vy, omega = states[:, 2], states[:, 3], states[:, 4], states[:, 5]
    cx = np.cos(phi) * 0.4 + np.sin(phi) * 0.3
    cy = np.sin(phi) * 0.4 - np.cos(phi) * 0.3
    kinetic = 1250.0 * ((vx - omega * cy) ** 2 + (vy + omega * cx) ** 2) + 1.75e5 * omega**2
    kinetic += 45.0 * np.sum(states[:, 10:14] ** 2, axis=1)
    chords = np.empty((len(t), 4))
    for k, y in enumerate(states):
        lengths(params, y, chords[k])
    ea = TELESCOPE.stiffness
    elastic = np.sum(ea * (chords - states[:, 6:10]) ** 2 / (2.0 * states[:, 6:10]), axis=1)
    tension = ea * (chords / states[:, 6:10] - 1.0)
    power = -np.sum((pull + tension**2 / (2.0 * ea)) * states[:, 10:14], axis=1)
    work = np.concatenate([[0.0], np.cumsum(0.5 * (power[1:] + power[:-1]) * np.diff(t))])
    change = kinetic + elastic - kinetic[0] - elastic[0]
    assert np.ptp(change) > 1e3
    assert np.abs(change - work).max() < 1e-4 * np.ptp(change)


FRICTION = {"force": 250.0, "transition_speed": 0.004}


@pytest.mark.parametrize("law", sorted(parameters.LAWS))
def test_friction_dissipates_and_reaches_its_level(law):
    """Driven slowly over a closed cycle, every smoothing does the work of F times the path."""
    hidden = effect("winch_coulomb_friction", 3, law=law, **FRICTION)
    params = parameters.build([hidden])
    t = np.linspace(0.0, 40.0, 400_001)
    speed = 0.5 * np.sin(2.0 * np.pi * t / 20.0)
    bristle, work, path = 0.0, 0.0, 0.0
    dt = t[1] - t[0]
    for v in speed:
        loss, rate = winch_loss(params, 2, v, 20e3, bristle)
        bristle += dt * rate
        work += dt * loss * v
        path += dt * abs(v)
    assert work == pytest.approx(250.0 * path, rel=0.02)
    assert work < 250.0 * path * 1.001


def test_friction_opposes_motion_in_the_plant():
    """A platform swinging on friction winches loses energy faster than without them."""

    def swing(effects):
        params = parameters.build(effects)
        start = at_rest(params, 0.0, np.zeros(3), np.full(4, 20e3))
        start[3] = 0.5
        _, states = open_loop(params, None, [20e3] * 4, 10.0, h=2e-4, start=start)
        return abs(states[-1, 3])

    slow = swing([effect("winch_coulomb_friction", law="tanh", force=200.0, transition_speed=0.02)])
    assert slow < 0.9 * swing([])


def test_sag_inverts_exactly_and_softens():
    sag = effect("cable_sag", weight=2.1, reference_tension=20e3)
    params = parameters.build([sag])
    for tension in (4e3, 12e3, 20e3, 35e3):
        pose = np.zeros(3)
        y = at_rest(params, 0.0, pose, np.full(4, tension))
        chord = np.empty(4)
        lengths(params, pose, chord)
        found = elastic_tension(params, 0, chord[0], chord[0] / y[6] - 1.0)
        assert found == pytest.approx(tension, rel=1e-10)
    chord = 890.0
    slack = elastic_tension(params, 0, chord, 4e-4)
    assert elastic_tension(params, 0, chord, 5e-4) - slack < 0.5e-4 * 2 * 15.2e6


def test_delay_cuts_the_interval_where_the_command_switches():
    """A step of one command arrives after exactly the delay, though that is no whole sample."""
    params = parameters.build([effect("winch_delay", delay=0.0237)])
    n, dt = 21, 0.01
    commands = np.full((n, 4), 10e3)
    commands[5:] += 400.0
    y0 = at_rest(params, 0.0, np.zeros(3), np.full(4, 10e3))
    quiet = np.zeros((n + 1, 3))
    late = replay(params, 0.0, dt, 1e-4, y0, 0, n - 1, commands, quiet[:n], quiet)
    assert np.abs(late[7, 10:14]).max() < 1e-9
    # Shortly after the switch at 73.7 ms the winch accelerates by force over lumped mass.
    mass = 0.5 * TELESCOPE.density * y0[6]
    np.testing.assert_allclose(late[8, 10:14], -400.0 / mass * 0.0063, rtol=0.01)


@pytest.mark.parametrize(
    "hidden",
    [
        [],
        [effect("winch_coulomb_friction", 3, law="lugre", **FRICTION)],
        [effect("winch_coulomb_friction", law="tanh", **FRICTION)],
        [effect("winch_delay", delay=0.137), effect("winch_lag", time_constant=0.08)],
        [effect("cable_sag", weight=2.1, reference_tension=20e3)],
    ],
    ids=["nominal", "lugre", "tanh", "delay_lag", "sag"],
)
def test_step_halving_stays_below_the_noise(hidden):
    """Halving the step moves no reading by more than 1 % of its noise."""
    settings = trial.Settings(seed=5, duration=30.0, rate=25.0)
    coarse = trial.run(settings, hidden)
    fine = trial.run(settings, hidden, step_scale=0.5)
    for name, sigma in coarse.noise.items():
        assert np.abs(coarse.clean[name] - fine.clean[name]).max() < 0.01 * sigma, name


def test_noise_has_the_stated_statistics():
    record = trial.run(trial.Settings(seed=11, duration=100.0, channels=ALL_CHANNELS))
    assert len(record.columns) == 15
    for name, sigma in record.noise.items():
        error = (record.columns[name] - record.clean[name]) / sigma
        n = error.size
        assert abs(error.mean()) < 4.0 / np.sqrt(n), name
        assert abs(error.std() - 1.0) < 4.0 / np.sqrt(2.0 * n), name
        assert abs(np.corrcoef(error[1:], error[:-1])[0, 1]) < 4.0 / np.sqrt(n), name


ALL_CHANNELS = ("x", "y", "phi", "cable_length", "unstretched_length", "tension")


def test_sensor_maps():
    plain = trial.Settings(seed=3, duration=10.0, channels=ALL_CHANNELS)
    hidden = [
        effect("length_sensor_bias", 2, bias=0.05),
        effect("length_sensor_scale", 4, factor=1e-3),
        dict(effect("length_sensor_bias", 1, bias=-0.2), channel="cable_length"),
        effect("tension_sensor_gain", 3, factor=0.02),
        effect("tension_sensor_bias", 3, bias=-70.0),
    ]
    record = trial.run(plain, hidden)
    true_lengths = record.states[:, 6:10]
    np.testing.assert_allclose(record.clean["unstretched_length[1]"], true_lengths[:, 0])
    np.testing.assert_allclose(record.clean["unstretched_length[2]"], true_lengths[:, 1] + 0.05)
    np.testing.assert_allclose(record.clean["unstretched_length[4]"], true_lengths[:, 3] * 1.001)
    chord = np.empty(4)
    lengths(record.params, record.states[7], chord)
    assert record.clean["cable_length[1]"][7] == pytest.approx(chord[0] - 0.2, abs=1e-12)
    np.testing.assert_allclose(record.clean["tension[2]"], record.tensions[:, 1])
    np.testing.assert_allclose(record.clean["tension[3]"], 1.02 * record.tensions[:, 2] - 70.0)
    # Tension from an independent evaluation of the law without damping: within the damping's part.
    static = TELESCOPE.stiffness * (chord / true_lengths[7] - 1.0)
    np.testing.assert_allclose(record.tensions[7], static, atol=50.0)


def test_pose_sensor_delay_and_bias():
    hidden = [
        effect("pose_sensor_delay", delay=0.1),
        effect("pose_sensor_bias", x=0.3, y=-0.2, phi=1e-3),
    ]
    record = trial.run(trial.Settings(seed=4, duration=20.0), hidden)
    shift = 5  # 0.1 s at 50 Hz
    bias = np.array([0.3, -0.2, 1e-3])
    for axis, name in enumerate(("x", "y", "phi")):
        late = record.states[:-shift, axis] + bias[axis]
        np.testing.assert_allclose(record.clean[name][shift:], late, rtol=0, atol=1e-9)


def test_pose_sensor_delay_between_samples():
    record = trial.run(
        trial.Settings(seed=4, duration=20.0), [effect("pose_sensor_delay", delay=0.11)]
    )
    x = record.states[:, 0]
    # Half-way between samples: cubic interpolation of the true pose is good to micrometres.
    middle = (-x[:-3] + 9.0 * x[1:-2] + 9.0 * x[2:-1] - x[3:]) / 16.0
    np.testing.assert_allclose(record.clean["x"][7:], middle[: len(x) - 7], rtol=0, atol=2e-5)


def test_commands_are_what_the_plant_received(tmp_path):
    """Replaying the file's own winch forces from the true start gives the true states."""
    record = trial.run(trial.Settings(seed=8, duration=20.0, wind=60.0, dither=100.0))
    trial.write_csv(record, tmp_path / "a.csv")
    table = np.genfromtxt(tmp_path / "a.csv", delimiter=",", names=True, deletechars="")
    forces = np.column_stack([table[f"winch_force[{i}]"] for i in range(1, 5)])
    wrench = [table[f"disturbance_{k}"] for k in ("force_x", "force_y", "torque")]
    n = len(forces)
    quiet = np.zeros((n + 1, 3))
    again = replay(
        record.params,
        0.0,
        record.dt,
        record.h,
        record.states[0],
        0,
        n - 1,
        forces,
        np.column_stack(wrench),
        quiet,
    )
    np.testing.assert_array_equal(again, record.states)


def test_distribution_gives_the_wrench_and_the_mean():
    params = parameters.build()
    pose = np.array([4.0, -3.0, 0.08])
    out = np.empty(4)
    distribute(params, pose, 300.0, -200.0, 5e3, 20e3, out)
    assert out.mean() == pytest.approx(20e3, abs=0.01)
    rigid = parameters.build((), "rigid")
    y, rate = np.zeros(state_count(rigid)), np.zeros(state_count(rigid))
    tension = np.empty(4)
    y[:3] = pose
    derivative(rigid, 0.0, y, out, np.array([-300.0, 200.0, -5e3]), rate, tension)
    assert np.abs(rate[3:5]).max() < 1e-6
    assert abs(rate[5]) < 1e-7


@pytest.mark.parametrize("robot", [FIELD, BENCH, EIGHT])
def test_a_robot_held_by_other_numbers_of_cables_is_at_rest(robot):
    params = parameters.build((), "rigid", robot)
    pose = np.array([0.3, -0.2, 0.04])
    held, mean = np.empty(robot.cables), 0.1 * robot.most
    distribute(params, pose, 0.0, 0.0, 0.0, mean, held)
    y, rate = np.zeros(state_count(params)), np.zeros(state_count(params))
    y[:3] = pose
    tension = np.empty(robot.cables)
    derivative(params, 0.0, y, held, np.zeros(3), rate, tension)
    # Forces are rounded to 1 mN.
    rest = 1e-3 * robot.cables / min(robot.mass, robot.inertia / robot.lever)
    assert np.abs(rate[3:6]).max() < rest
    np.testing.assert_allclose(tension, held, atol=1e-2)
    if robot.cables > 3:
        assert held.mean() == pytest.approx(mean, rel=1e-6)


def test_a_falling_platform_falls_with_its_centre_of_mass():
    """Slack cables, an off-centre mass: the centre of mass falls by g t^2 / 2 and nothing turns."""
    values = parameters.nominal("lumped_mass", FIELD)
    values.update(com_x=0.3, com_y=-0.2, rho=1e-9, drum=np.ones(3))
    params = parameters.freeze(values)
    start = np.zeros(state_count(params))
    start[6:9] = 1e3
    t, states = open_loop(params, None, np.zeros(3), 1.0, start=start)
    np.testing.assert_allclose(states[:, 1], -0.5 * 9.81 * t**2, atol=1e-6)
    assert np.abs(states[:, [0, 2]]).max() < 1e-6


def test_gaps_and_outliers_are_as_frequent_as_asked():
    record = trial.run(trial.Settings(seed=9, gaps=0.03, outliers=0.005))
    for name, column in record.columns.items():
        lost = np.isnan(column).mean()
        assert 0.005 < lost < 0.08, name
        far = np.abs(column - record.clean[name]) > 7.0 * record.noise[name]
        assert 0.001 < far.mean() < 0.012, name


def test_trials_are_reproducible():
    settings = trial.Settings(seed=6, duration=10.0, turbulence=5.0)
    first, second = trial.run(settings), trial.run(settings)
    for name in first.columns:
        np.testing.assert_array_equal(first.columns[name], second.columns[name])


def test_strength_is_zero_without_an_effect_and_grows_with_it():
    settings = trial.Settings(seed=2, duration=30.0)
    assert strength(trial.run(settings)) < 0.01
    weak = strength(trial.run(settings, [effect("platform_linear_drag", coefficient=10.0)]))
    strong = strength(trial.run(settings, [effect("platform_linear_drag", coefficient=40.0)]))
    assert strong == pytest.approx(4.0 * weak, rel=0.25)


def test_the_suite_has_what_it_promises():
    groups = {}
    for case in suite.SUITE:
        groups.setdefault(case.group, []).append(case)
    assert len(groups["null"]) == 60
    assert len(groups["outside"]) >= 6
    assert len(groups["pair"]) + len(groups["triple"]) >= 10
    assert len(suite.SUITE) - 60 >= 40
    alone = {e["id"] for case in groups["single"] + groups["elasticity"] for e in case.effects}
    assert len(alone) == 33
    assert {case.group for case in suite.select(small=True)} >= {"single", "pair", "null"}


def test_written_case_is_complete(tmp_path):
    case = next(case for case in suite.SUITE if case.name == "near_wind")
    write_case(case, tmp_path)
    folder = tmp_path / "near_wind"
    truth = json.loads((folder / "truth.json").read_text())
    assert truth["effects"][0]["id"] == "steady_wind"
    header, first = (folder / "train1.csv").read_text().splitlines()[:2]
    assert header.startswith("time,winch_force[1],winch_force[2]")
    assert len(header.split(",")) == len(first.split(",")) == 12
    assert (folder / "model.toml").read_text() == 'cable_model = "lumped_mass"\n'


def _truth(*effects, group="single"):
    return {
        "case": "a",
        "group": group,
        "effects": [dict(e, located=places(e, TELESCOPE.cables)) for e in effects],
        "cables": TELESCOPE.cables,
        "terms": [],
        "acceptable": [],
        "ambiguous": "no",
    }


def _answer(*effects, verdict="named", rivals=(), where=(), terms=()):
    found = [
        {
            "id": e["id"],
            "cable": e["cable"],
            "parameters": {
                k: {"value": v, "standard_error": 1.0} for k, v in e["parameters"].items()
            },
            "indistinguishable_from": list(rivals),
        }
        for e in effects
    ]
    return {
        "verdict": verdict,
        "located": [{"where": w} for w in where],
        "effects": found,
        "terms": list(terms),
        "gap": {"holdout": {"before": 3.0, "after": 1.0}},
        "search": {"null_test": None},
    }


def test_judge_tells_right_from_wrong():
    coulomb = effect("winch_coulomb_friction", 3, force=250.0, transition_speed=0.01)
    capstan = effect("pulley_capstan_loss", 3, loss=0.0125)
    truth = _truth(coulomb)
    good = judge(_answer(coulomb, where=["winch[3]"]), truth, 1.0)
    assert good["exact"]
    assert good["correct"]
    assert good["located"] == 1.0
    wrong = judge(_answer(capstan, where=["winch[2]"]), truth, 1.0)
    assert not wrong["correct"]
    assert wrong["located"] == 0.0
    rival = {"id": "winch_coulomb_friction", "cable": 3}
    open_ = judge(_answer(capstan, verdict="ambiguous", rivals=[rival]), truth, 1.0)
    assert open_["correct"]
    assert not open_["exact"]
    surplus = judge(_answer(coulomb, capstan), truth, 1.0)
    assert not surplus["correct"]
    extra = judge(
        _answer(coulomb, terms=[{"target": "platform.torque", "expression": "x"}]), truth, 1
    )
    assert not extra["exact"]


def test_the_right_law_with_another_radius_is_not_exact():
    """A drum of 0.3 m found as one of 0.5 m counted as exact."""
    drum = effect("winch_drum_eccentricity", 1, eccentricity=0.01, drum_radius=0.3, phase=0.4)
    truth = _truth(drum)
    assert judge(_answer(drum), truth, 1.0)["exact"]
    answer = _answer(drum)
    radius = answer["effects"][0]["parameters"]["drum_radius"]
    radius.update(value=0.5, standard_error=3e-4)
    assert not judge(answer, truth, 1.0)["exact"]
    # Not known to better than that, or off by less than a tenth.
    radius.update(value=0.5, standard_error=0.1)
    assert judge(answer, truth, 1.0)["exact"]
    radius.update(value=0.31, standard_error=1e-4)
    assert judge(answer, truth, 1.0)["exact"]
    # A shape of the law that was left out has no error.
    radius.update(value=0.0, standard_error=None)
    assert not judge(answer, truth, 1.0)["exact"]


def test_judge_counts_false_alarms():
    quiet = judge(_answer(verdict="no_missing_effect"), _truth(group="null"), 1.0)
    assert quiet["false_alarms"] == 0
    noisy = judge(_answer(effect("platform_mass", mass=3.0)), _truth(group="null"), 1.0)
    assert noisy["false_alarms"] == 1
    doubtful = judge(_answer(verdict="unnamed"), _truth(group="null"), 1.0)
    assert doubtful["false_alarms"] == 0
    assert not doubtful["exact"]


def test_judge_merges_four_winches_and_turns_gusts():
    four = [effect("winch_force_gain", i, factor=0.01) for i in range(1, 5)]
    assert names(four, 4) == {("winch_force_gain", None)}
    assert names(four, 6) == names(four[:4], 6) != names(four, 4)
    gust = effect("periodic_gust", amplitude=50.0, frequency=0.9, phase=0.4, direction=0.6)
    turned = effect(
        "periodic_gust", amplitude=50.0, frequency=0.9, phase=0.4 - np.pi, direction=0.6 + np.pi
    )
    errors = parameter_errors(_answer(turned), _truth(gust))
    assert max(abs(e["z"]) for e in errors) < 1e-9


def test_a_case_redrawn_hides_the_same_in_another_trial():
    (case,), (other,) = suite.select(["quadratic_drag"]), suite.select(["quadratic_drag"], redraw=1)
    assert other.effects == case.effects
    assert other.holdout == case.holdout.but(seed=case.holdout.seed + 1)
    short = [c.train[0].but(duration=2.0) for c in (case, other)]
    first, second = (trial.run(settings, case.effects) for settings in short)
    assert np.abs(first.states[:, :2] - second.states[:, :2]).max() > 0.01


def test_the_truth_is_a_model_file_unless_it_is_outside_the_catalogue():
    truth = _truth(
        effect("winch_coulomb_friction", 3, force=250.0, transition_speed=0.01),
        effect("platform_mass", mass=120.0),
    )
    model = tomllib.loads(truth_model(truth, 'cable_model = "lumped_mass"\n'))
    assert model["cable_model"] == "lumped_mass"
    friction, mass = model["effect"]
    assert friction == {
        "id": "winch_coulomb_friction",
        "cable": 3,
        "force": 250.0,
        "transition_speed": 0.01,
    }
    assert mass == {"id": "platform_mass", "mass": 120.0}
    outside = dict(truth, terms=[{"expression": "x"}])
    assert truth_model(outside, "") is None


def test_a_gap_counts_against_what_the_true_model_leaves():
    row = judge(_answer(), _truth(), 1.0)
    rows = [dict(row, gap_after=2.5, gap_truth=2.4), dict(row, gap_after=2.5, gap_truth=1.0)]
    score = summary(rows)
    assert score["gap_after_within_1.1"] == 0.0
    assert score["gap_of_truth_within_1.1"] == 0.5
    assert "| 2.5 (truth: 2.4) |" in markdown(score, rows)


def test_moordyn_cables_carry_the_known_law_at_rest_and_differ_in_motion():
    still = trial.Settings(seed=1, duration=3.0, rate=25.0, amplitude=1e-9, rotation=1e-12)
    quiet = still.but(pose_noise=1e-9, angle_noise=1e-12, length_noise=1e-9)
    record = moordyn_trial.run(quiet)
    np.testing.assert_allclose(record.tensions, record.forces, rtol=1e-4)
    assert np.abs(record.states[:, 10:14]).max() < 1e-5
    moving = trial.Settings(seed=1, duration=12.0, rate=25.0)
    first, second = moordyn_trial.run(moving), moordyn_trial.run(moving)
    np.testing.assert_array_equal(first.states, second.states)
    assert strength(first) > 1.0


def test_an_effect_that_begins_acts_from_then_on_only():
    """Up to its beginning the trial is that without it, and from there on another one."""
    settings = trial.Settings(seed=5, duration=8.0, lead_in=2.0)
    wind = {"id": "steady_wind", "cable": None}
    wind["parameters"] = {"force_x": 500.0, "force_y": 0.0, "torque": 0.0}
    without, always = trial.run(settings), trial.run(settings, [wind])
    begun = trial.run(settings, [dict(wind, **{"from": 4.0})])
    ended = trial.run(settings, [dict(wind, until=4.0)])
    k = round(4.0 * settings.rate)
    np.testing.assert_array_equal(begun.states[: k + 1], without.states[: k + 1])
    np.testing.assert_array_equal(ended.states[: k + 1], always.states[: k + 1])
    # At its beginning it moves the platform by F t^2 / 2 m.
    moved = begun.states[k + 25, 0] - without.states[k + 25, 0]
    assert moved == pytest.approx(0.5 * 500.0 / 2500.0 * 0.5**2, rel=0.2)


def test_errors_of_the_geometry_are_in_the_data_and_no_cause():
    [case] = suite.select(["geometry_null_0"])
    assert truth(case, {}, {})["effects"] == []
    assert len(truth(case, {}, {})["survey"]) == 8
    short = case.train[0].but(duration=4.0)
    told, plain = (run_trial(replace(case, survey=s), short) for s in (case.survey, ()))
    lengths = [name for name in told.clean if name.startswith("unstretched_length")]
    off = [np.mean(told.clean[name] - plain.clean[name]) for name in lengths]
    assert len(off) == 4
    assert max(map(abs, off)) > 5e-3, off
