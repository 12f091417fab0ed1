"""The reference plant against printed numbers, closed forms and conservation laws."""

import math
import tomllib

import numpy as np
import pytest

from reference.parameters import (
    CABLE_MODELS,
    LUMPED_MASS,
    MASSLESS_SPRING,
    RIGID,
    Effect,
    Inputs,
    Parameters,
)
from reference.plant import Plant
from reference.simulation import simulate

EQUAL = [1000.0] * 4
RELEASE = (0.1, 0.1, 0.1)

# Released at rest under 1000 N in each cable, each spring carrying it: t, x, y, φ, l(4), T(4),
# with the digits printed where the case was published.
RELEASE_TABLE = """
0 0.1 0.1 0.1 901.1354009 898.9960286 900.852594 898.9991587 1000 1000 1000 1000
1 0.09996146395 0.09995968337 0.1000568557 901.1359055 898.9954669 900.8532093 898.9985983 \
1000.081074 999.90959 1000.094669 999.9095578
5 0.09903854427 0.09899415739 0.1014233341 901.1481507 898.9818407 900.8681242 898.9850023 \
1000.055707 999.9428216 1000.068239 999.9432948
10 0.09617267687 0.09599688657 0.1057332615 901.1868182 898.9388839 900.9150799 898.9421384 \
1000.086979 999.9020214 1000.10683 999.9028128
20 0.08498329362 0.08430780395 0.1235809352 901.3476993 898.7612063 901.1083041 898.7648046 \
1000.125725 999.8635548 1000.145636 999.8638785
50 0.01818326125 0.01506077759 0.2778655904 902.758377 897.2470203 902.7113214 897.2519394 \
1000.260172 999.7379766 1000.263891 999.737674
"""


def half_a_unit(value: float) -> float:
    """Half a unit in the last of ten significant digits."""
    return 0.5 * 10.0 ** (math.floor(math.log10(abs(value))) - 9)


def test_release_matches_the_published_table_to_its_digits():
    table = np.array([[float(v) for v in line.split()] for line in RELEASE_TABLE.split("\n")[1:-1]])
    plant = Plant(Parameters())
    run = simulate(
        plant,
        plant.initial_state(RELEASE, command=EQUAL),
        Inputs.constant(EQUAL),
        table[:, 0],
    )
    names = [
        "x",
        "y",
        "phi",
        *(f"unstretched_length[{i}]" for i in range(1, 5)),
        *(f"tension[{i}]" for i in range(1, 5)),
    ]
    for column, name in enumerate(names, start=1):
        for row in range(len(table)):
            printed = table[row, column]
            # A tension is EA times the difference of two lengths of 900 m: the integrator's 1e-12
            # and the rounding of its steps reach its tenth digit.
            slack = 1e-6 if name.startswith("tension") else 1.02 * half_a_unit(printed)
            assert run.outputs[name][row] == pytest.approx(printed, abs=slack), (
                name,
                table[row, 0],
            )


def statics(plant, pose, tension):
    """Wrench of equal cable tensions on a platform at rest."""
    m = plant.motion(pose, np.zeros(3))
    pull = -tension * m.S
    return np.array([pull.sum().real, pull.sum().imag, (m.arm.conj() * pull).imag.sum()])


def test_stiffness_at_the_centre_has_its_closed_form():
    plant, tension, h = Plant(Parameters()), 1000.0, 1e-3
    a, b = 900.0, 10.0
    length = math.hypot(a, b)
    expected = np.diag(
        [
            2 * tension * (a - b) ** 2 / length**3,
            2 * tension * (a + b) ** 2 / length**3,
            -4 * tension * a**2 * b**2 / length**3,
        ]
    )
    stiffness = np.column_stack(
        [
            -(statics(plant, h * unit, tension) - statics(plant, -h * unit, tension)) / (2 * h)
            for unit in np.eye(3)
        ]
    )
    assert stiffness == pytest.approx(expected, rel=1e-6, abs=1e-6)
    assert expected[2, 2] == pytest.approx(-0.444 * tension, rel=1e-3)


def jacobian(function, y, steps):
    columns = []
    for k, h in enumerate(steps):
        ahead, behind = y.copy(), y.copy()
        ahead[k] += h
        behind[k] -= h
        columns.append((function(ahead) - function(behind)) / (2 * h))
    return np.column_stack(columns)


def test_periods_under_equal_forces():
    plant = Plant(Parameters(cable_model=RIGID))
    matrix = jacobian(
        lambda y: plant.evaluate(0.0, y, np.array(EQUAL), np.zeros(3))[0], np.zeros(6), [1e-3] * 6
    )
    values = np.linalg.eigvals(matrix)
    periods = sorted(2 * math.pi / v.imag for v in values if v.imag > 1e-6)
    growth = max(v.real for v in values)
    assert periods == pytest.approx([221.0, 227.0], abs=0.5)
    assert 1.0 / growth == pytest.approx(29.6, abs=0.05)


def test_modes_with_locked_winches():
    plant = Plant(Parameters())
    y0 = plant.initial_state(np.zeros(3), command=EQUAL)

    def platform_rates(y):
        return plant.evaluate(0.0, np.concatenate([y, y0[6:]]), np.array(EQUAL), np.zeros(3))[0][:6]

    values = np.linalg.eigvals(jacobian(platform_rates, np.zeros(6), [1e-5] * 6))
    oscillating = sorted((v for v in values if v.imag > 0), key=lambda v: -v.imag)
    periods = [2 * math.pi / abs(v) for v in oscillating]
    damping = [-v.real / abs(v) for v in oscillating]
    assert periods == pytest.approx([1.43, 1.73, 1.77], abs=0.005)
    assert min(damping) == pytest.approx(0.0023, abs=5e-5)
    assert max(damping) == pytest.approx(0.0029, abs=5e-5)


@pytest.mark.parametrize("inertia", ["paper", "reeled", "none"])
def test_kinematics_agree_with_differences_along_a_path(inertia):
    plant = Plant(Parameters(cable_inertia=inertia))

    def pose(t):
        return np.array([3 * math.sin(t), 2 * math.cos(2 * t), 0.3 * math.sin(1.3 * t)])

    def rate(f, t, h=1e-4):
        return (-f(t + 2 * h) + 8 * f(t + h) - 8 * f(t - h) + f(t - 2 * h)) / (12 * h)

    def twist(t):
        return rate(pose, t)

    def motion(t):
        return plant.motion(pose(t), twist(t))

    t = 0.7
    m = motion(t)
    assert m.L_rate == pytest.approx(rate(lambda s: motion(s).L, t), rel=1e-7)
    assert m.angle_rate == pytest.approx(rate(lambda s: motion(s).angle, t), rel=1e-7)
    L_acc, angle_acc = plant._cable_accelerations(m, twist(t), rate(twist, t))
    assert L_acc == pytest.approx(rate(lambda s: motion(s).L_rate, t), rel=1e-6)
    assert angle_acc == pytest.approx(rate(lambda s: motion(s).angle_rate, t), rel=1e-6)


def test_massless_springs_do_not_change_the_motion():
    inputs = Inputs(
        [0.0, 0.3, 0.7],
        [
            [5000, 4000, 6000, 5500, 100, 0, 0],
            [4000, 6000, 0, 5000, 0, -300, 900],
            [5000] * 4 + [0, 0, 0],
        ],
    )
    t = np.linspace(0, 1.2, 13)
    runs = []
    for model in (RIGID, MASSLESS_SPRING):
        plant = Plant(Parameters(cable_model=model))
        y0 = plant.initial_state((4, -3, 0.2), (0.5, 0.2, -0.01), command=inputs.at(0.0)[:4])
        runs.append(simulate(plant, y0, inputs, t, rtol=1e-10, atol=1e-10).outputs)
    for name in ("x", "y", "phi", "vx", "omega", "tension[1]", "tension[3]"):
        assert runs[1][name] == pytest.approx(runs[0][name], rel=1e-9, abs=1e-9)
    assert np.max(np.abs(runs[1]["strain[1]"])) > 1e-4


def test_stiff_lumped_cables_approach_rigid_ones():
    # With the inertia of the reeled-out length in place of the geometric one the difference is of
    # the order of the strain; the cable mode rings with an amplitude of the same order.
    t = np.linspace(0, 4, 9)
    inputs = Inputs.constant([20000, 21000, 19000, 20500])
    runs = {}
    for model, factor in ((RIGID, 1), (LUMPED_MASS, 1), (LUMPED_MASS, 100)):
        plant = Plant(
            Parameters(cable_model=model, youngs_modulus=38e9 * factor, cable_damping=2e7)
        )
        y0 = plant.initial_state((4, -3, 0.2), command=inputs.at(0.0)[:4])
        runs[model, factor] = simulate(plant, y0, inputs, t, rtol=1e-10, atol=1e-10).outputs
    gap = [np.max(np.abs(runs[LUMPED_MASS, f]["x"] - runs[RIGID, 1]["x"])) for f in (1, 100)]
    assert gap[1] < 0.02 * gap[0] < 0.02 * 0.1


@pytest.mark.parametrize("model", CABLE_MODELS)
def test_work_and_energy_balance_without_cable_mass(model):
    """Massless cables: winches and disturbances do work on the platform alone (a massless spring
    passes its force on)."""
    plant = Plant(Parameters(cable_model=model, cable_inertia="none"))
    force, wrench = np.array([3000.0, 5000.0, 4000.0, 4500.0]), np.array([50.0, -80.0, 300.0])
    inputs = Inputs.constant(force, wrench)
    t = np.array([0.0, 1.5])
    y0 = plant.initial_state((5, 2, -0.3), (0.4, -0.3, 0.02), command=force)
    run = simulate(plant, y0, inputs, t)
    kinetic = [0.5 * (2500 * (y[3] ** 2 + y[4] ** 2) + 3.5e5 * y[5] ** 2) for y in run.y]
    lengths = np.array(
        [[run.outputs[f"cable_length[{i}]"][k] for i in range(1, 5)] for k in (0, 1)]
    )
    work = -force @ (lengths[1] - lengths[0]) + wrench @ (run.y[1, :3] - run.y[0, :3])
    assert kinetic[1] - kinetic[0] == pytest.approx(work, rel=1e-9)
    assert abs(work) > 20.0


@pytest.mark.parametrize("model", CABLE_MODELS)
def test_slack_cables_never_push(model):
    plant = Plant(Parameters(cable_model=model))
    inputs = Inputs([0.0, 0.3], [[8000, 8000, 8000, 8000, 0, 0, 0], [8000, 0, 8000, -600, 0, 0, 0]])
    t = np.linspace(0, 1.5, 31)
    y0 = plant.initial_state((4, -3, 0.2), (0.3, 0, 0), command=inputs.at(0.0)[:4])
    run = simulate(plant, y0, inputs, t, rtol=1e-9, atol=1e-9).outputs
    tension = np.array([run[f"tension[{i}]"] for i in range(1, 5)])
    assert tension.min() == 0.0
    assert (tension[3] == 0.0).any()
    assert tension[0].min() > 5000.0


def test_a_ramp_is_the_limit_of_small_steps():
    plant = Plant(Parameters(cable_model=RIGID))
    slope = [[100, -200, 300, -50, 10, 5, 40]]
    base = [[5000, 5000, 5000, 5000, 0, 0, 0]]
    y0 = plant.initial_state((1, 2, 0.1))
    t = np.array([0.0, 1.0])
    ramp = simulate(plant, y0, Inputs([0.0], base, slope), t).y[-1]
    gaps = []
    for n in (20, 40):
        knots = np.arange(n) / n
        steps = np.array(base) + np.outer(knots + 0.5 / n, slope[0])
        gaps.append(np.max(np.abs(simulate(plant, y0, Inputs(knots, steps), t).y[-1] - ramp)))
    assert gaps[0] < 1e-3
    assert gaps[1] == pytest.approx(gaps[0] / 4, rel=0.05)  # midpoint steps: second order


def slack_platform(effects):
    """A platform on cables that carry neither load nor mass: only what the effects do to it."""
    return Plant(Parameters(cable_model=RIGID, cable_inertia="none", effects=tuple(effects)))


def test_the_centre_of_mass_of_a_free_platform_moves_straight():
    offset = complex(0.7, -0.4)
    plant = slack_platform([Effect("platform_com_offset", None, {"x": 0.7, "y": -0.4})])
    t = np.linspace(0, 20, 5)
    run = simulate(
        plant, plant.initial_state((1, 2, 0.3), (0.2, -0.1, 0.15)), Inputs.constant([0] * 4), t
    )
    com = run.y[:, 0] + 1j * run.y[:, 1] + offset * np.exp(1j * run.y[:, 2])
    velocity = complex(0.2, -0.1) + 0.15j * offset * np.exp(0.3j)
    assert com == pytest.approx(com[0] + velocity * t, rel=1e-10)
    assert run.y[:, 5] == pytest.approx(0.15, rel=1e-12)


def test_quadratic_drag_slows_down_as_one_over_time():
    plant = slack_platform([Effect("platform_quadratic_drag", None, {"coefficient": 25.0})])
    t = np.array([0.0, 30.0])
    run = simulate(plant, plant.initial_state((0, 0, 0), (2, 0, 0)), Inputs.constant([0] * 4), t)
    assert run.y[-1, 3] == pytest.approx(2 / (1 + 2 * 25 / 2500 * 30), rel=1e-10)


def tensions_after(effects, times, forces, t):
    plant = slack_platform(effects)
    inputs = Inputs(times, [[f, 0, 0, 0, 0, 0, 0] for f in forces])
    y0 = plant.initial_state((0, 0, 0), command=inputs.at(0.0)[:4])
    return simulate(plant, y0, inputs, t).outputs["tension[1]"]


def test_winch_chain_by_its_step_responses():
    t = np.array([0.0, 0.4, 0.6, 1.0, 2.0])
    step = ([0.0, 0.5], [100.0, 300.0])
    delayed = tensions_after([Effect("winch_delay", 1, {"delay": 0.2})], *step, t)
    assert delayed.tolist() == [100, 100, 100, 300, 300]
    lagged = tensions_after([Effect("winch_lag", None, {"time_constant": 0.3})], *step, t)
    since = np.maximum(t - 0.5, 0)
    assert lagged == pytest.approx(300 - 200 * np.exp(-since / 0.3), rel=1e-9)
    limited = tensions_after(
        [
            Effect("winch_saturation", None, {"lower": 150.0, "upper": 250.0}),
            Effect("winch_force_gain", 1, {"factor": 0.1}),
            Effect("winch_force_bias", 1, {"bias": 7.0}),
        ],
        *step,
        t,
    )
    assert limited == pytest.approx([172, 172, 282, 282, 282])


@pytest.mark.parametrize(
    ("effect", "expected"),
    [
        (Effect("winch_coulomb_friction", None, {"force": 50.0, "transition_speed": 0.05}), 50.0),
        (Effect("winch_viscous_friction", None, {"coefficient": 30.0}), 30.0 * 0.4),
        (Effect("pulley_capstan_loss", None, {"loss": 0.02}), 20.0),
    ],
)
def test_losses_add_to_the_pull_when_paying_out(effect, expected):
    plant = slack_platform([effect])
    m = plant.motion(np.zeros(3), np.array([0.4, 0, 0]))
    tension = plant.evaluate(0.0, np.array([0, 0, 0, 0.4, 0, 0]), np.array(EQUAL), np.zeros(3))[2]
    assert tension - 1000 == pytest.approx(
        expected * np.sign(m.L_rate) * (np.abs(m.L_rate) / 0.4 if "viscous" in effect.id else 1),
        rel=1e-4,
    )


def test_sensor_bias_shows_on_its_channel_only():
    def read(*effects):
        plant = Plant(Parameters(effects=effects))
        y0 = plant.initial_state(RELEASE, command=EQUAL)
        return plant.outputs(0.0, y0, np.array(EQUAL), np.zeros(3))

    plain = read()
    biased = read(Effect("length_sensor_bias", 2, {"bias": 0.05}))
    changed = {name for name in plain if plain[name] != biased[name]}
    assert changed == {"unstretched_length[2]"}
    assert biased["unstretched_length[2]"] - plain["unstretched_length[2]"] == pytest.approx(0.05)
    named = read(Effect("length_sensor_bias", 2, {"bias": 0.05, "channel": "cable_length"}))
    assert {name for name in plain if plain[name] != named[name]} == {"cable_length[2]"}


def test_model_file_carries_every_value_exactly():
    parameters = Parameters(
        platform_mass=1 / 3,
        cable_model=MASSLESS_SPRING,
        effects=(Effect("winch_lag", 3, {"time_constant": 0.1 + 0.2}),),
    )
    data = tomllib.loads(parameters.to_toml())
    assert data["platform_mass"] == parameters.platform_mass
    assert tuple(data["anchor_angle"]) == parameters.anchor_angle
    assert data["effect"] == [{"id": "winch_lag", "cable": 3, "time_constant": 0.1 + 0.2}]
