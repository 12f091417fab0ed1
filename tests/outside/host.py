"""A bare FMI 2.0 host on ctypes, which passes on whatever it is told to, null pointers included.

Only the standard library: it starts quickly in a process of its own.
"""

from __future__ import annotations

import ctypes
import platform
import sys
import xml.etree.ElementTree as ElementTree
from ctypes import (
    CFUNCTYPE,
    POINTER,
    Structure,
    byref,
    c_char_p,
    c_double,
    c_int,
    c_size_t,
    c_void_p,
)
from ctypes import c_uint as c_reference
from pathlib import Path

OK, WARNING, DISCARD, ERROR, FATAL, PENDING = range(6)
CO_SIMULATION = 1
LAST_SUCCESSFUL_TIME, TERMINATED = 2, 3

LOGGER = CFUNCTYPE(None, c_void_p, c_char_p, c_int, c_char_p, c_char_p)


class Callbacks(Structure):
    """fmi2CallbackFunctions; every pointer may be null."""

    _fields_ = [
        ("logger", LOGGER),
        ("allocate_memory", c_void_p),
        ("free_memory", c_void_p),
        ("step_finished", c_void_p),
        ("environment", c_void_p),
    ]


def _signatures():
    c, n, refs = c_void_p, c_size_t, POINTER(c_reference)
    reals, ints, text = POINTER(c_double), POINTER(c_int), c_char_p
    states = POINTER(c_void_p)
    return {
        "SetDebugLogging": [c, c_int, n, POINTER(text)],
        "SetupExperiment": [c, c_int, c_double, c_double, c_int, c_double],
        "EnterInitializationMode": [c],
        "ExitInitializationMode": [c],
        "Terminate": [c],
        "Reset": [c],
        "GetReal": [c, refs, n, reals],
        "GetInteger": [c, refs, n, ints],
        "GetBoolean": [c, refs, n, ints],
        "GetString": [c, refs, n, POINTER(text)],
        "SetReal": [c, refs, n, reals],
        "SetInteger": [c, refs, n, ints],
        "SetBoolean": [c, refs, n, ints],
        "SetString": [c, refs, n, POINTER(text)],
        "GetFMUstate": [c, states],
        "SetFMUstate": [c, c_void_p],
        "FreeFMUstate": [c, states],
        "SerializedFMUstateSize": [c, c_void_p, POINTER(n)],
        "SerializeFMUstate": [c, c_void_p, c_char_p, n],
        "DeSerializeFMUstate": [c, c_char_p, n, states],
        "GetDirectionalDerivative": [c, refs, n, refs, n, reals, reals],
        "SetRealInputDerivatives": [c, refs, n, ints, reals],
        "GetRealOutputDerivatives": [c, refs, n, ints, reals],
        "DoStep": [c, c_double, c_double, c_int],
        "CancelStep": [c],
        "GetStatus": [c, c_int, ints],
        "GetRealStatus": [c, c_int, reals],
        "GetIntegerStatus": [c, c_int, ints],
        "GetBooleanStatus": [c, c_int, ints],
        "GetStringStatus": [c, c_int, POINTER(text)],
    }


SIGNATURES = _signatures()


def library(folder: Path, identifier: str = "CablePlatform") -> Path:
    """The FMU's binary for this machine."""
    bits = 64 if sys.maxsize > 2**32 else 32
    system = {"Linux": "linux", "Darwin": "darwin", "Windows": "win"}[platform.system()]
    suffix = {"linux": ".so", "darwin": ".dylib", "win": ".dll"}[system]
    return folder / "binaries" / f"{system}{bits}" / (identifier + suffix)


class Host:
    """The FMU's functions, without the `fmi2` in front of their names."""

    def __init__(self, folder: Path):
        self.folder = folder
        root = ElementTree.parse(folder / "modelDescription.xml").getroot()
        self.guid = root.get("guid").encode()
        self.references = {
            v.get("name"): int(v.get("valueReference")) for v in root.iter("ScalarVariable")
        }
        self.library = ctypes.CDLL(str(library(folder)))
        for name, arguments in SIGNATURES.items():
            function = getattr(self.library, f"fmi2{name}")
            function.argtypes, function.restype = arguments, c_int
            setattr(self, name, function)
        self.library.fmi2Instantiate.argtypes = [
            c_char_p,
            c_int,
            c_char_p,
            c_char_p,
            c_void_p,
            c_int,
            c_int,
        ]
        self.library.fmi2Instantiate.restype = c_void_p
        self.library.fmi2FreeInstance.argtypes = [c_void_p]
        self.library.fmi2FreeInstance.restype = None
        for name in ("GetVersion", "GetTypesPlatform"):
            getattr(self.library, f"fmi2{name}").restype = c_char_p
        self.messages: list[tuple[int, str, str]] = []
        self.logger = LOGGER(self._log)
        self._callbacks = []

    def _log(self, _environment, _instance, status, category, message):
        self.messages.append((status, (category or b"").decode(), (message or b"").decode()))

    @property
    def resources(self) -> bytes:
        """The URI of the resources, as the standard has it."""
        return (self.folder / "resources").resolve().as_uri().encode()

    def instantiate(
        self,
        name: bytes | None = b"plant",
        kind: int = CO_SIMULATION,
        guid: bytes | None = b"",
        resources: bytes | None = b"",
        logger=None,
        logging_on: bool = False,
        callbacks: bool = True,
    ):
        """A component handle or None; an empty guid or resources stands for the right one."""
        table = Callbacks()
        if logger is not None:
            table.logger = logger
        self._callbacks.append(table)
        return self.library.fmi2Instantiate(
            name,
            kind,
            self.guid if guid == b"" else guid,
            self.resources if resources == b"" else resources,
            ctypes.addressof(table) if callbacks else None,
            0,
            int(logging_on),
        )

    def free(self, component):
        """fmi2FreeInstance"""
        self.library.fmi2FreeInstance(component)

    def initialised(self, **options):
        """An instance in step mode at t = 0."""
        component = self.instantiate(**options)
        assert component, self.messages
        self.initialise(component)
        return component

    def initialise(self, component, stop_time: float | None = None):
        """From instantiated to step mode."""
        has_stop = int(stop_time is not None)
        assert self.SetupExperiment(component, 0, 0.0, 0.0, has_stop, stop_time or 0.0) == OK
        assert self.EnterInitializationMode(component) == OK
        assert self.ExitInitializationMode(component) == OK

    def refs(self, *names):
        """An array of value references; numbers pass as they are."""
        found = [n if isinstance(n, int) else self.references[n] for n in names]
        return (c_reference * len(found))(*found)

    def real(self, component, name: str) -> float:
        """One real variable."""
        value = c_double()
        assert self.GetReal(component, self.refs(name), 1, byref(value)) == OK
        return value.value

    def set_real(self, component, name: str, value: float) -> int:
        """Set one real variable; returns the status."""
        return self.SetReal(component, self.refs(name), 1, byref(c_double(value)))

    def state(self, component) -> c_void_p:
        """A saved state."""
        state = c_void_p()
        assert self.GetFMUstate(component, byref(state)) == OK
        return state

    def serialised(self, component) -> bytes:
        """The present state as bytes."""
        state, size = self.state(component), c_size_t()
        assert self.SerializedFMUstateSize(component, state, byref(size)) == OK
        data = ctypes.create_string_buffer(size.value)
        assert self.SerializeFMUstate(component, state, data, size) == OK
        assert self.FreeFMUstate(component, byref(state)) == OK
        return data.raw

    def prove_alive(self):
        """The library still does its work: a fresh instance starts, steps and is freed."""
        component = self.initialised(name=b"proof")
        assert self.DoStep(component, 0.0, 0.1, 1) == OK
        assert abs(self.real(component, "cable_length[1]")) > 100.0
        assert self.Terminate(component) == OK
        self.free(component)
