"""A packed FMU and its instances, addressed by variable names, on top of fmpy."""

from __future__ import annotations

from ctypes import byref, c_size_t
from pathlib import Path

import numpy as np
from fmpy import extract, read_model_description
from fmpy.fmi2 import FMU2Slave, fmi2CallbackFunctions, fmi2FMUstate

from reference.parameters import CABLES, SCALARS, Inputs, Parameters

COMMANDS = ("force", "torque", "speed", "length")


def input_names(cables: int, command: str = "force") -> tuple[str, ...]:
    """The inputs of a robot with so many cables, in their order."""
    disturbances = ("disturbance_force_x", "disturbance_force_y", "disturbance_torque")
    return (*(f"winch_{command}[{i}]" for i in range(1, cables + 1)), *disturbances)


INPUTS = input_names(CABLES)
POSE = ("x", "y", "phi")
TWIST = ("vx", "vy", "omega")
ACCELERATION = ("ax", "ay", "alpha")
WINCHES = ("winch_angle", "winch_rate")
PER_CABLE = (
    "cable_length",
    "unstretched_length",
    "unstretched_length_rate",
    "tension",
    "strain",
    "cable_angle",
)


def output_names(cables: int) -> tuple[str, ...]:
    """The real outputs of a robot with so many cables."""
    per_cable = (f"{name}[{i}]" for name in PER_CABLE for i in range(1, cables + 1))
    winches = (f"{name}[{i}]" for name in WINCHES for i in range(1, cables + 1))
    return (*POSE, *TWIST, *per_cable, *ACCELERATION, *winches)


OUTPUTS = output_names(CABLES)
SLACK = tuple(f"slack[{i}]" for i in range(1, CABLES + 1))


def indexed(name: str) -> list[str]:
    """`name[1]` to `name[4]`."""
    return [f"{name}[{i}]" for i in range(1, CABLES + 1)]


class Fmu:
    """An unpacked FMU."""

    def __init__(self, folder: Path, path: Path | None = None):
        self.folder, self.path = folder, path
        self.description = read_model_description(folder)
        self.variables = {v.name: v for v in self.description.modelVariables}
        self.command = next(c for c in COMMANDS if f"winch_{c}[1]" in self.variables)

    @classmethod
    def unpack(cls, path: Path, folder: Path) -> Fmu:
        """Unpack the archive `path` into `folder`."""
        return cls(Path(extract(path, folder)), path)

    def instance(self, name: str = "plant", values=None, start=True, **experiment) -> Instance:
        """A new instance; initialised with `values` unless `start` is False."""
        instance = Instance(self, name)
        if start:
            instance.initialise(values, **experiment)
        return instance

    def references(self, names) -> list[int]:
        """Value references by name."""
        return [self.variables[name].valueReference for name in names]

    def enumeration(self, name: str, item: str) -> int:
        """The value of an item of the variable's enumeration."""
        items = self.variables[name].declaredType.items
        return next(int(i.value) for i in items if i.name == item)


class Instance:
    """One instance; a context manager that frees it."""

    def __init__(self, fmu: Fmu, name: str = "plant"):
        self.fmu = fmu
        self.time = 0.0
        self.slave = FMU2Slave(
            guid=fmu.description.guid,
            unzipDirectory=str(fmu.folder),
            modelIdentifier=fmu.description.coSimulation.modelIdentifier,
            instanceName=name,
        )
        # No logger: a host need not have one, and errors are told by the status.
        self.slave.instantiate(callbacks=fmi2CallbackFunctions())

    def __enter__(self) -> Instance:
        return self

    def __exit__(self, *_):
        self.slave.freeInstance()

    def initialise(self, values=None, start_time=0.0, stop_time=None, tolerance=None):
        """Through initialisation mode to step mode."""
        self.begin(values, start_time, stop_time, tolerance)
        self.slave.exitInitializationMode()

    def begin(self, values=None, start_time=0.0, stop_time=None, tolerance=None):
        """Into initialisation mode, with `values` set before."""
        self.slave.setupExperiment(tolerance, start_time, stop_time)
        self.set(values or {})
        self.slave.enterInitializationMode()
        self.time = start_time

    def set(self, values: dict):
        """Set variables by name, each by its own type; enumerations take the item's name."""
        real = {}
        for name, value in values.items():
            variable = self.fmu.variables[name]
            if variable.type == "Real":
                real[variable.valueReference] = float(value)
            elif variable.type == "Boolean":
                self.slave.setBoolean([variable.valueReference], [value])
            elif variable.type == "String":
                self.slave.setString([variable.valueReference], [value])
            else:
                if isinstance(value, str):
                    value = self.fmu.enumeration(name, value)
                self.slave.setInteger([variable.valueReference], [value])
        if real:
            self.slave.setReal(list(real), list(real.values()))

    def get(self, names) -> np.ndarray:
        """Real variables by name."""
        return np.array(self.slave.getReal(self.fmu.references(names)))

    def value(self, name: str):
        """One variable of any type."""
        variable = self.fmu.variables[name]
        getter = {
            "Real": self.slave.getReal,
            "Boolean": self.slave.getBoolean,
            "String": self.slave.getString,
        }.get(variable.type, self.slave.getInteger)
        return getter([variable.valueReference])[0]

    def step(self, size: float):
        """One communication step."""
        self.slave.doStep(self.time, size)
        self.time += size

    def step_to(self, end: float):
        """One communication step that ends at `end`, without rounding drift."""
        self.slave.doStep(self.time, end - self.time)
        self.time = end

    def set_inputs(self, inputs: Inputs, time: float):
        """The values and slopes that hold just after `time`."""
        k = inputs.segment(time)
        names = input_names(inputs.values.shape[1] - 3, self.fmu.command)
        self.set(dict(zip(names, inputs.on_segment(k, time), strict=True)))
        if inputs.slopes[k].any():
            references = self.fmu.references(names)
            self.slave.setRealInputDerivatives(references, [1] * len(names), list(inputs.slopes[k]))

    def run(self, inputs: Inputs, t_out, steps=None, names=OUTPUTS) -> dict[str, np.ndarray]:
        """Drive the instance over `t_out`; `steps` are further communication points.

        Inputs are set only where they change; every knot of theirs is a communication point.
        Outputs at `t_out` are read before the inputs of that instant are set.
        """
        t_out = np.asarray(t_out, dtype=float)
        end = t_out[-1]
        knots = {t for t in inputs.times if self.time < t < end}
        points = sorted({*t_out, *knots, *(() if steps is None else steps)})
        wanted = set(t_out)
        rows = []
        self.set_inputs(inputs, self.time)
        for point in points:
            if point > self.time:
                self.step_to(point)
            if point in wanted:
                rows.append(self.get(names))
            if point in knots:
                self.set_inputs(inputs, point)
        return dict(zip(names, np.array(rows).T, strict=True))

    def snapshot(self) -> np.ndarray:
        """Every real variable, for bit-for-bit comparisons."""
        names = [v.name for v in self.fmu.description.modelVariables if v.type == "Real"]
        return self.get(names)

    def serialised(self) -> bytes:
        """The present state as bytes."""
        state = self.slave.getFMUstate()
        size = c_size_t()
        self.slave.fmi2SerializedFMUstateSize(self.slave.component, state, byref(size))
        data = self.slave.serializeFMUstate(state)
        assert len(data) == size.value
        self.slave.freeFMUstate(state)
        return data

    def restore(self, data: bytes):
        """Continue from a serialised state."""
        state = fmi2FMUstate()
        self.slave.deSerializeFMUstate(data, state)
        self.slave.setFMUstate(state)
        self.slave.freeFMUstate(state)


def start_values(p: Parameters) -> dict:
    """The parameters as FMU variables (effects and the cable's inertia are in the model file)."""
    values = {name: getattr(p, name) for name in SCALARS}
    values |= dict(zip(indexed("anchor_angle"), p.anchor_angle, strict=True))
    values |= dict(zip(indexed("attachment_angle"), p.attachment_angle, strict=True))
    return values | {"cable_model": p.cable_model}


def input_values(inputs: Inputs, time: float = 0.0, command: str = "force") -> dict:
    """The inputs just after `time`, by name."""
    names = input_names(inputs.values.shape[1] - 3, command)
    return dict(zip(names, inputs.at(time), strict=True))
