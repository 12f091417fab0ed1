"""Everything a host can do wrong: `misuse.py FMU-FOLDER CASE` does one of it.

Each case asserts that it is told so by the status, and that the library still works afterwards.
The process ends with exit code 0 only then; a crash is seen from outside.
"""

from __future__ import annotations

import ctypes
import math
import random
import sys
from ctypes import byref, c_char_p, c_double, c_int, c_size_t, c_void_p
from pathlib import Path

sys.path.insert(0, str(Path(__file__).resolve().parent.parent))

from outside.host import (
    DISCARD,
    ERROR,
    LAST_SUCCESSFUL_TIME,
    OK,
    SIGNATURES,
    TERMINATED,
    Host,
)

CASES = {}
NOWHERE = 4_000_000_000  # no variable has this value reference
GETTERS = (
    ("GetReal", c_double),
    ("GetInteger", c_int),
    ("GetBoolean", c_int),
    ("GetString", c_char_p),
)
SETTERS = tuple((name.replace("Get", "Set"), kind) for name, kind in GETTERS)


def case(function):
    CASES[function.__name__] = function
    return function


def refused(status: int, *what, allowed=(ERROR,)):
    assert status in allowed, (status, *what)


def harmless_arguments(name: str) -> list:
    """Arguments after the component that ask for as little as possible."""
    values = []
    for kind in SIGNATURES[name][1:]:
        if kind is c_double:
            values.append(0.1)
        elif kind in (c_int, c_size_t):
            values.append(0)
        else:
            values.append(None)
    return values


@case
def null_component(host: Host):
    for name in SIGNATURES:
        refused(getattr(host, name)(None, *harmless_arguments(name)), name)
    host.free(None)


@case
def made_up_component(host: Host):
    for address in (0x1, 0xDEAD, 2**63):
        for name in SIGNATURES:
            refused(getattr(host, name)(address, *harmless_arguments(name)), name)
        host.free(address)


@case
def component_used_after_free(host: Host):
    component = host.initialised()
    host.free(component)
    for name in SIGNATURES:
        refused(getattr(host, name)(component, *harmless_arguments(name)), name)
    host.free(component)


@case
def null_arrays(host: Host):
    component = host.initialised()
    one = host.refs("x")
    for name, kind in (*GETTERS, *SETTERS):
        refused(getattr(host, name)(component, None, 1, byref(kind())), name)
        component = renewed(host, component)
        refused(getattr(host, name)(component, one, 1, None), name)
        component = renewed(host, component)
        refused(getattr(host, name)(component, None, 2**62, None), name)
        component = renewed(host, component)
    for name in ("SetRealInputDerivatives", "GetRealOutputDerivatives"):
        order, value = byref(c_int(1)), byref(c_double())
        for arguments in ((None, 1, order, value), (one, 1, None, value), (one, 1, order, None)):
            refused(getattr(host, name)(component, *arguments), name)
            component = renewed(host, component)
    known, d = host.refs("winch_force[1]"), byref(c_double())
    for arguments in (
        (None, 1, known, 1, d, d),
        (one, 1, None, 1, d, d),
        (one, 1, known, 1, None, d),
        (one, 1, known, 1, d, None),
    ):
        refused(host.GetDirectionalDerivative(component, *arguments), arguments)
        component = renewed(host, component)
    for name in ("GetFMUstate", "SetFMUstate"):
        refused(getattr(host, name)(component, None), name)
        component = renewed(host, component)
    for name in ("GetStatus", "GetRealStatus", "GetIntegerStatus", "GetBooleanStatus"):
        refused(getattr(host, name)(component, 0, None), name, allowed=(ERROR, DISCARD))
        component = renewed(host, component)
    host.free(component)


def renewed(host: Host, component):
    """The same instance, reset and initialised again: an error must not spoil it for good."""
    assert host.Reset(component) == OK
    host.initialise(component)
    return component


@case
def nothing_asked_for_is_no_misuse(host: Host):
    component = host.initialised()
    for name, _ in (*GETTERS, *SETTERS):
        assert getattr(host, name)(component, None, 0, None) == OK, name
    assert host.FreeFMUstate(component, byref(c_void_p())) == OK
    assert host.FreeFMUstate(component, None) in (OK, ERROR)
    host.free(component)


@case
def unknown_value_references(host: Host):
    component = host.initialised()
    for name, kind in (*GETTERS, *SETTERS):
        refused(getattr(host, name)(component, host.refs(NOWHERE), 1, byref(kind())), name)
        component = renewed(host, component)
    both = host.refs("x", NOWHERE)
    values = (c_double * 2)(1.0, 2.0)
    refused(host.GetReal(component, both, 2, values))
    component = renewed(host, component)
    for unknown, known in ((NOWHERE, "winch_force[1]"), ("x", NOWHERE)):
        refused(
            host.GetDirectionalDerivative(
                component, host.refs(unknown), 1, host.refs(known), 1, values, values
            )
        )
        component = renewed(host, component)
    for name in ("SetRealInputDerivatives", "GetRealOutputDerivatives"):
        refused(getattr(host, name)(component, host.refs(NOWHERE), 1, byref(c_int(1)), values))
        component = renewed(host, component)
    host.free(component)


@case
def references_of_another_type(host: Host):
    """Reals and the rest number their variables apart: what is a Real may be no Integer."""
    component = host.initialised(logger=host.logger)
    refused(host.GetInteger(component, host.refs("phi"), 1, byref(c_int())))
    assert "no variable of type Integer" in host.messages[-1][2], host.messages
    renewed(host, component)
    refused(host.GetString(component, host.refs("phi"), 1, byref(c_char_p())))
    host.free(component)


@case
def more_values_than_variables(host: Host):
    component = host.initialised()
    count = len(host.references) + 1
    same = (ctypes.c_uint * count)(*[host.references["x"]] * count)
    for name, kind in (*GETTERS, *SETTERS):
        refused(getattr(host, name)(component, same, count, (kind * count)()), name)
        component = renewed(host, component)
    host.free(component)


@case
def models_that_cannot_be(host: Host):
    """Values within their bounds that make no robot: told by name at the latest moment."""
    for name, value, words in (
        ("platform_mass", 0.0, "greater than 0"),
        ("attachment_radius", 1e4, "less than `anchor_radius`"),
        ("x", 2000.0, "inside the anchors"),
        ("phi", 1.5, "runs through it"),
    ):
        component = host.instantiate(logger=host.logger)
        assert host.set_real(component, name, value) == OK
        assert host.SetupExperiment(component, 0, 0.0, 0.0, 0, 0.0) == OK
        assert host.EnterInitializationMode(component) == OK
        refused(host.ExitInitializationMode(component), name)
        assert words in host.messages[-1][2], host.messages
        renewed(host, component)
        host.free(component)


@case
def a_list_with_one_wrong_entry_changes_nothing(host: Host):
    component = host.initialised()
    assert host.set_real(component, "winch_force[1]", 1234.0) == OK
    both = host.refs("winch_force[1]", NOWHERE)
    refused(host.SetReal(component, both, 2, (c_double * 2)(99.0, 99.0)))
    assert host.Reset(component) == OK
    host.free(component)


@case
def derivatives_of_the_wrong_kind(host: Host):
    component = host.initialised()
    value = byref(c_double())

    def directional(unknown, known):
        return host.GetDirectionalDerivative(
            component, host.refs(unknown), 1, host.refs(known), 1, byref(c_double(1.0)), value
        )

    for unknown, known in (
        ("winch_force[1]", "x"),  # an input is no unknown
        ("x", "tension[1]"),  # an output that is no state is no known
        ("platform_mass", "x"),
    ):
        refused(directional(unknown, known), unknown, known)
        renewed(host, component)
    for order in (0, -1, 2, 2**31 - 1):
        refused(
            host.GetRealOutputDerivatives(component, host.refs("x"), 1, byref(c_int(order)), value),
            order,
        )
        renewed(host, component)
    for order in (0, -1):
        refused(
            host.SetRealInputDerivatives(
                component, host.refs("winch_force[1]"), 1, byref(c_int(order)), value
            ),
            order,
        )
        renewed(host, component)
    for seed in (math.nan, math.inf):
        refused(
            host.GetDirectionalDerivative(
                component, host.refs("der(vx)"), 1, host.refs("x"), 1, byref(c_double(seed)), value
            ),
            seed,
        )
        renewed(host, component)
    slope = byref(c_double(1.0))
    refused(
        host.SetRealInputDerivatives(component, host.refs("x"), 1, byref(c_int(1)), slope)
    )  # no input
    renewed(host, component)
    refused(
        host.SetRealInputDerivatives(
            component, host.refs("winch_force[1]"), 1, byref(c_int(1)), byref(c_double(math.nan))
        )
    )
    host.free(component)


@case
def values_that_are_no_numbers(host: Host):
    component = host.initialised()
    for value in (math.nan, math.inf, -math.inf):
        for name in ("winch_force[1]", "disturbance_torque"):
            refused(host.set_real(component, name, value), name, value)
            component = renewed(host, component)
    host.free(component)
    fresh = host.instantiate()
    for value in (math.nan, math.inf):
        for name in ("x", "unstretched_length[1]", "platform_mass"):
            refused(host.set_real(fresh, name, value), name, value)
            assert host.Reset(fresh) == OK
    for name in ("cable_model", "initialization"):
        for item in (0, -1, 99):
            reference = host.refs(name)
            refused(host.SetInteger(fresh, reference, 1, byref(c_int(item))), name, item)
            assert host.Reset(fresh) == OK
    host.free(fresh)


@case
def variables_that_cannot_be_set(host: Host):
    component = host.initialised()
    for name in ("tension[1]", "der(x)", "platform_mass", "x", "cable_length[2]"):
        refused(host.set_real(component, name, 1.0), name)
        component = renewed(host, component)
    assert host.Terminate(component) == OK
    refused(host.set_real(component, "winch_force[1]", 1.0))
    host.free(component)


@case
def wrong_order_of_calls(host: Host):
    fresh = host.instantiate()
    value = byref(c_double())
    refused(host.ExitInitializationMode(fresh), "exit before enter")
    assert host.Reset(fresh) == OK
    refused(host.DoStep(fresh, 0.0, 0.1, 1), "step before initialisation")
    assert host.Reset(fresh) == OK
    refused(host.Terminate(fresh), "terminate before initialisation")
    assert host.Reset(fresh) == OK
    refused(
        host.GetRealStatus(fresh, LAST_SUCCESSFUL_TIME, value),
        "status before a step",
        allowed=(OK, DISCARD, ERROR),
    )
    assert host.Reset(fresh) == OK
    host.SetupExperiment(fresh, 0, 0.0, 0.0, 0, 0.0)
    assert host.EnterInitializationMode(fresh) == OK
    refused(host.EnterInitializationMode(fresh), "enter twice")
    assert host.Reset(fresh) == OK
    host.SetupExperiment(fresh, 0, 0.0, 0.0, 0, 0.0)
    assert host.EnterInitializationMode(fresh) == OK
    refused(host.DoStep(fresh, 0.0, 0.1, 1), "step in initialisation mode")
    assert host.Reset(fresh) == OK
    host.initialise(fresh)
    refused(host.SetupExperiment(fresh, 0, 0.0, 0.0, 0, 0.0), "set up in step mode")
    renewed(host, fresh)
    refused(host.EnterInitializationMode(fresh), "enter in step mode")
    renewed(host, fresh)
    assert host.Terminate(fresh) == OK
    refused(host.Terminate(fresh), "terminate twice")
    assert host.Reset(fresh) == OK
    host.initialise(fresh)
    assert host.Terminate(fresh) == OK
    refused(host.DoStep(fresh, 0.0, 0.1, 1), "step after terminate")
    host.free(fresh)


@case
def experiments_that_cannot_be(host: Host):
    fresh = host.instantiate()
    nan, inf = math.nan, math.inf
    for arguments in (
        (0, 0.0, nan, 0, 0.0),
        (0, 0.0, inf, 0, 0.0),
        (0, 0.0, 0.0, 1, nan),
        (0, 0.0, 10.0, 1, 5.0),
        (1, -1e-6, 0.0, 0, 0.0),
        (1, nan, 0.0, 0, 0.0),
    ):
        refused(host.SetupExperiment(fresh, *arguments), arguments)
        assert host.Reset(fresh) == OK
    # Fields that are not defined may hold anything.
    assert host.SetupExperiment(fresh, 0, nan, 0.0, 0, nan) == OK
    assert host.EnterInitializationMode(fresh) == OK
    assert host.ExitInitializationMode(fresh) == OK
    assert host.DoStep(fresh, 0.0, 0.1, 1) == OK
    host.free(fresh)


@case
def steps_that_cannot_be_taken(host: Host):
    component = host.initialised()
    for point, size in (
        (0.0, -0.1),
        (0.0, 0.0),
        (0.0, math.nan),
        (0.0, math.inf),
        (0.5, 0.1),
        (-0.5, 0.1),
        (math.nan, 0.1),
        (math.inf, 0.1),
    ):
        refused(host.DoStep(component, point, size, 1), point, size, allowed=(ERROR, DISCARD))
        renewed(host, component)
    assert host.DoStep(component, 0.0, 0.1, 1) == OK
    refused(host.DoStep(component, 0.0, 0.1, 1), "the same step twice")
    renewed(host, component)
    # Hosts add up their steps: a communication point may be off by rounding.
    time = 0.0
    for k in range(1000):
        assert host.DoStep(component, time if k % 2 else k * 0.1, 0.1, 1) == OK, k
        time += 0.1
    host.free(component)


@case
def a_step_beyond_the_stop_time(host: Host):
    component = host.instantiate()
    host.initialise(component, stop_time=1.0)
    assert host.DoStep(component, 0.0, 0.9, 1) == OK
    refused(host.DoStep(component, 0.9, 0.2, 1), allowed=(ERROR, DISCARD))
    assert host.Reset(component) == OK
    host.initialise(component, stop_time=1.0)
    assert host.DoStep(component, 0.0, 1.0 + 1e-15, 1) == OK
    host.free(component)


@case
def a_step_that_the_solver_cannot_take(host: Host):
    """One winch pulls the platform into its anchor: the step is discarded, not the instance."""
    component = host.initialised()
    assert host.DoStep(component, 0.0, 0.1, 1) == OK
    saved = host.state(component)
    for k, force in enumerate((1e9, 0.0, 0.0, 0.0), start=1):
        assert host.set_real(component, f"winch_force[{k}]", force) == OK
    refused(host.DoStep(component, 0.1, 100.0, 0), allowed=(DISCARD,))
    time = c_double()
    assert host.GetRealStatus(component, LAST_SUCCESSFUL_TIME, byref(time)) == OK
    assert 0.1 <= time.value < 100.1, time.value
    assert math.isfinite(host.real(component, "x"))
    assert host.SetFMUstate(component, saved) == OK
    assert host.DoStep(component, 0.1, 0.1, 1) == OK
    assert host.FreeFMUstate(component, byref(saved)) == OK
    host.free(component)


@case
def a_platform_that_leaves_its_anchors(host: Host):
    """The model asks for the end: the status says so, and going back to a saved state goes on."""
    component = host.initialised(logger=host.logger, logging_on=True)
    saved = host.state(component)
    assert host.set_real(component, "disturbance_force_x", 5e4) == OK
    steps = 0
    while (status := host.DoStep(component, float(steps), 1.0, 1)) == OK:
        steps += 1
        assert steps < 1000
    assert status == DISCARD
    assert any("left the space between the anchors" in text for _, _, text in host.messages)
    ended, time = c_int(), c_double()
    assert host.GetBooleanStatus(component, TERMINATED, byref(ended)) == OK
    assert host.GetRealStatus(component, LAST_SUCCESSFUL_TIME, byref(time)) == OK
    assert ended.value == 1
    assert steps < time.value <= steps + 1
    assert host.real(component, "x") > 500.0
    assert host.SetFMUstate(component, saved) == OK
    assert host.DoStep(component, 0.0, 1.0, 1) == OK
    assert host.GetBooleanStatus(component, TERMINATED, byref(ended)) == OK
    assert ended.value == 0
    host.free(component)


@case
def what_is_not_offered(host: Host):
    component = host.initialised()
    refused(host.CancelStep(component), "no asynchronous steps")
    renewed(host, component)
    for name in ("GetStatus", "GetRealStatus", "GetIntegerStatus", "GetBooleanStatus"):
        slot = c_double() if "Real" in name else c_int()
        for kind in (-1, 17):
            refused(
                getattr(host, name)(component, kind, byref(slot)), name, allowed=(ERROR, DISCARD)
            )
            renewed(host, component)
    host.free(component)


@case
def logging_of_unknown_categories(host: Host):
    component = host.instantiate(logger=host.logger)
    names = (c_char_p * 2)(b"logAll", b"no such category")
    refused(host.SetDebugLogging(component, 1, 2, names), allowed=(OK, 1, ERROR))
    refused(host.SetDebugLogging(component, 1, 2, None))
    assert host.Reset(component) == OK
    refused(host.SetDebugLogging(component, 1, 1, (c_char_p * 1)(None)), "a null category")
    assert host.Reset(component) == OK
    assert host.SetDebugLogging(component, 1, 0, None) == OK
    host.free(component)


@case
def instantiation_that_cannot_be(host: Host):
    for options in (
        {"kind": 0},
        {"kind": 7},
        {"guid": None},
        {"guid": b"{00000000-0000-0000-0000-000000000000}"},
        {"name": None},
        {"name": b""},
    ):
        assert not host.instantiate(**options), options
    # Without callbacks there is nobody to tell; refused or not, nothing breaks.
    component = host.instantiate(callbacks=False)
    if component:
        host.free(component)


def corrupted(data: bytes, generator: random.Random):
    yield b""
    yield data[:7]
    yield data[: len(data) // 2]
    yield data[:-1]
    yield data + b"\0"
    yield generator.randbytes(len(data))
    yield bytes(len(data))
    for _ in range(200):
        position = generator.randrange(len(data))
        bit = 1 << generator.randrange(8)
        yield data[:position] + bytes([data[position] ^ bit]) + data[position + 1 :]


@case
def serialised_state_that_is_damaged(host: Host):
    component = host.initialised()
    assert host.DoStep(component, 0.0, 0.1, 1) == OK
    data = host.serialised(component)
    for broken in corrupted(data, random.Random(1)):
        state = c_void_p()
        refused(host.DeSerializeFMUstate(component, broken, len(broken), byref(state)), len(broken))
        assert not state.value
    renewed(host, component)
    refused(host.DeSerializeFMUstate(component, None, 10, byref(c_void_p())), "null bytes")
    renewed(host, component)
    refused(host.DeSerializeFMUstate(component, data, len(data), None), "null state")
    renewed(host, component)
    state = c_void_p()
    assert host.DeSerializeFMUstate(component, data, len(data), byref(state)) == OK
    assert host.SetFMUstate(component, state) == OK
    assert host.DoStep(component, 0.1, 0.1, 1) == OK
    host.free(component)


@case
def serialising_into_too_little_space(host: Host):
    component = host.initialised()
    state, size = host.state(component), c_size_t()
    assert host.SerializedFMUstateSize(component, state, byref(size)) == OK
    small = ctypes.create_string_buffer(b"\xaa" * 64, 64)
    refused(host.SerializeFMUstate(component, state, small, 16))
    assert small.raw[16:] == b"\xaa" * 48
    renewed(host, component)
    refused(host.SerializeFMUstate(component, state, None, size), "null buffer")
    renewed(host, component)
    refused(host.SerializedFMUstateSize(component, state, None), "null size")
    renewed(host, component)
    refused(host.SerializedFMUstateSize(component, None, byref(size)), "null state")
    host.free(component)


@case
def states_freed_twice_or_made_up(host: Host):
    component = host.initialised()
    state = host.state(component)
    stale = c_void_p(state.value)
    assert host.FreeFMUstate(component, byref(state)) == OK
    assert not state.value
    refused(host.FreeFMUstate(component, byref(stale)), "freed twice")
    renewed(host, component)
    refused(host.SetFMUstate(component, c_void_p(0x1234)), "made up")
    renewed(host, component)
    again = c_void_p(stale.value)
    refused(host.SetFMUstate(component, again), "used after free")
    renewed(host, component)
    refused(host.SerializeFMUstate(component, again, ctypes.create_string_buffer(9), 9))
    renewed(host, component)
    refused(host.GetFMUstate(component, byref(c_void_p(0x1234))), "made-up state to save over")
    host.free(component)


@case
def freed_instance_leaves_no_state_behind(host: Host):
    first, second = host.initialised(), host.initialised(name=b"second")
    state = host.state(first)
    host.free(first)
    # Either the state is gone with its instance or it is plain data; both are fine, a crash is not.
    refused(host.SetFMUstate(second, state), allowed=(OK, ERROR))
    host.free(second)


@case
def messages_are_no_format_strings(host: Host):
    """Hosts pass the message to printf: a percent sign of ours must not ask for an argument."""
    component = host.instantiate(
        name=b"100 %s %n %d", logger=host.logger, logging_on=True, resources=None
    )
    assert component
    refused(host.DoStep(component, 0.0, 0.1, 1))
    assert any(status == ERROR for status, _, _ in host.messages), host.messages
    for _, _, message in host.messages:
        assert message == "%s" or "%" not in message.replace("%%", ""), message
    host.free(component)


def main(folder: str, name: str):
    host = Host(Path(folder))
    CASES[name](host)
    host.prove_alive()
    print("alive")


if __name__ == "__main__":
    main(*sys.argv[1:])
