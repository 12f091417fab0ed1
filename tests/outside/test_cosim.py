"""The plant and the winch controller, two FMUs in the Open Simulation Platform's libcosim."""

from __future__ import annotations

import numpy as np
import pytest
from fmpy.validation import validate_fmu
from libcosimpy.CosimEnums import CosimVariableType
from libcosimpy.CosimExecution import CosimExecution
from libcosimpy.CosimLogging import CosimLogLevel, log_output_level
from libcosimpy.CosimObserver import CosimObserver
from libcosimpy.CosimSlave import CosimLocalSlave

from outside.fmu import POSE, TWIST, Fmu, indexed

STEP = 0.02
NANOSECOND = 1e-9


class Coupled:
    """Plant and controller, connected by the names of their variables."""

    def __init__(self, plant_fmu, controller_fmu):
        log_output_level(CosimLogLevel.WARNING)
        self.execution = CosimExecution.from_step_size(step_size=round(STEP / NANOSECOND))
        self.slaves, self.references = {}, {}
        for name, path in (("plant", plant_fmu), ("winch controller", controller_fmu)):
            slave = CosimLocalSlave(fmu_path=str(path), instance_name=name)
            index = self.execution.add_local_slave(slave)
            assert index >= 0, f"libcosim does not take {path}"
            self.slaves[name] = index
            self.references[name] = {
                v.name.decode(): (v.reference, v.type)
                for v in self.execution.slave_variables(index)
            }
        self.observer = CosimObserver.create_time_series(buffer_size=100_000)
        assert self.execution.add_observer(self.observer)

    def connect(self, source, target, names):
        for name in names:
            status = self.execution.connect_real_variables(
                self.slaves[source],
                self.references[source][name][0],
                self.slaves[target],
                self.references[target][name][0],
            )
            assert status == 0, name

    def start_value(self, slave, name, value):
        reference = self.references[slave][name][0]
        assert self.execution.real_initial_value(self.slaves[slave], reference, value)

    def watch(self, slave, names):
        for name in names:
            reference = self.references[slave][name][0]
            assert self.observer.start_time_series(
                self.slaves[slave], reference, CosimVariableType.REAL
            )

    def series(self, slave, name, count):
        """Times (s) and samples of a watched variable."""
        times, _, samples = self.observer.time_series_real_samples(
            self.slaves[slave], self.references[slave][name][0], 1, count
        )
        return np.array(times) * NANOSECOND, np.array(samples)


def test_controller_fmu_is_valid(controller_fmu):
    assert validate_fmu(str(controller_fmu)) == []


@pytest.mark.parametrize("model", ["lumped_mass", "rigid"])
def test_a_five_metre_circle_in_a_minute(pack, controller_fmu, model):
    plant = pack(f'cable_model = "{model}"\n')
    coupled = Coupled(plant.path, controller_fmu)
    coupled.connect("plant", "winch controller", [*POSE, *TWIST])
    coupled.connect("winch controller", "plant", indexed("winch_force"))
    for name in POSE:
        coupled.start_value("plant", name, 0.0)
    coupled.start_value("winch controller", "circle_radius", 5.0)
    coupled.start_value("winch controller", "circle_period", 60.0)
    coupled.start_value("winch controller", "ramp_time", 10.0)
    coupled.start_value("winch controller", "start_tension", 20_000.0)
    watched = [*POSE, *indexed("tension")]
    coupled.watch("plant", watched)
    coupled.watch("winch controller", ["reference_x", "reference_y"])
    end = 90.0
    assert coupled.execution.simulate_until(round(end / NANOSECOND))

    count = round(end / STEP)
    times, _ = coupled.series("plant", "x", count)
    assert len(times) == count
    found = {name: coupled.series("plant", name, count)[1] for name in watched}
    # The circle is reached after the ramp and a settling time; then one whole round of 60 s.
    on_circle = times > 30.0
    assert times[on_circle][-1] - times[on_circle][0] > 59.9
    radius = np.hypot(found["x"], found["y"])[on_circle]
    assert np.max(np.abs(radius - 5.0)) < 0.02
    turned = np.unwrap(np.arctan2(found["y"], found["x"])[on_circle])
    assert abs(turned[-1] - turned[0]) == pytest.approx(2 * np.pi, rel=5e-3)
    for name in ("x", "y"):
        wanted = coupled.series("winch controller", f"reference_{name}", count)[1]
        assert np.max(np.abs(found[name] - wanted)[on_circle]) < 0.02, name
    assert np.max(np.abs(found["phi"])[on_circle]) < 1e-4
    for name in indexed("tension"):
        assert found[name].min() > 1000.0, name


def test_defaults_fit_in_a_master_that_passes_nothing_at_initialisation(
    fmu, controller_fmu, tmp_path
):
    """Springs that carry 1 kN and a controller that began at 20 kN made the tensions swing."""
    controller = Fmu.unpack(controller_fmu, tmp_path / "controller")
    measured, forces = [*POSE, *TWIST], indexed("winch_force")
    largest = 0.0
    with fmu.instance() as plant, controller.instance("winch controller") as winches:
        for _ in range(round(30.0 / STEP)):
            pulls, motion = winches.get(forces), plant.get(measured)
            winches.set(dict(zip(measured, motion, strict=True)))
            winches.step(STEP)
            plant.set(dict(zip(forces, pulls, strict=True)))
            plant.step(STEP)
            largest = max(largest, np.abs(plant.get(indexed("tension")) - pulls).max())
        assert plant.get(indexed("tension")).min() > 19_000.0
    assert largest < 100.0


SMALL = """
platform_mass = 10.0
platform_inertia = 0.5
gravity = [0.0, -9.81]
cable_density = 0.01
youngs_modulus = 1e9
cable_area = 1e-5
cable_damping = 40.0
"""
THREE = (((2.0, 3.0), (0.2, -0.1)), ((-2.5, -1.0), (-0.2, -0.1)), ((1.0, 3.0), (-0.2, 0.1)))


def around(cables):
    """Cables from all around, every other one turning the platform the other way."""
    turns = 2 * np.pi * (np.arange(cables) + 0.5) / cables
    ends = turns + 2 * np.pi * np.where(np.arange(cables) % 2, -0.4, 0.4) / cables
    at = [np.c_[size * np.cos(a), size * np.sin(a)] for size, a in ((3.0, turns), (0.3, ends))]
    return np.stack(at, axis=1).tolist()


@pytest.mark.parametrize("ends", [THREE, around(8)], ids=["3 cables", "8 cables"])
def test_the_controller_drives_a_robot_of_any_cables(pack, controller_of, tmp_path, ends):
    tables = (f"[[cable]]\nanchor = {list(a)}\nattachment = {list(b)}\n" for a, b in ends)
    model = SMALL + "".join(tables)
    path = controller_of(model)
    assert validate_fmu(str(path)) == []
    controller = Fmu.unpack(path, tmp_path / "controller")
    measured = [*POSE, *TWIST]
    forces = [f"winch_force[{i + 1}]" for i in range(len(ends))]
    wanted = ["reference_x", "reference_y", "reference_phi"]
    settings = {
        "circle_radius": 0.1,
        "circle_period": 20.0,
        "ramp_time": 5.0,
        "position_bandwidth": 2.0,
        "orientation_bandwidth": 2.0,
        "filter_time": 0.05,
    }
    farthest = 0.0
    with (
        pack(model).instance(start=False) as plant,
        controller.instance("winch controller", settings) as winches,
    ):
        plant.initialise(dict(zip(forces, winches.get(forces), strict=True)))
        for k in range(round(40.0 / 0.01)):
            pulls, motion = winches.get(forces), plant.get(measured)
            if k > 1000:
                farthest = max(farthest, np.abs(winches.get(wanted) - motion[:3]).max())
            winches.set(dict(zip(measured, motion, strict=True)))
            winches.step(0.01)
            plant.set(dict(zip(forces, pulls, strict=True)))
            plant.step(0.01)
            assert winches.value("feasible")
    # One step late, 0.3 mm of the way, pretension pulls a little beside.
    assert farthest < 4e-3
