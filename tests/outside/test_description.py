"""What the FMU says of itself."""

from __future__ import annotations

import zipfile
from importlib.resources import files

import pytest
from fmpy.validation import validate_fmu
from lxml import etree

from outside.fmu import INPUTS, SLACK, indexed
from reference.parameters import Effect, Parameters

UNITS = {
    **dict.fromkeys(indexed("winch_force"), "N"),
    "disturbance_force_x": "N",
    "disturbance_force_y": "N",
    "disturbance_torque": "N.m",
    "x": "m",
    "y": "m",
    "phi": "rad",
    "vx": "m/s",
    "vy": "m/s",
    "omega": "rad/s",
    **dict.fromkeys(indexed("cable_length"), "m"),
    **dict.fromkeys(indexed("unstretched_length"), "m"),
    **dict.fromkeys(indexed("unstretched_length_rate"), "m/s"),
    **dict.fromkeys(indexed("tension"), "N"),
    **dict.fromkeys(indexed("strain"), "1"),
    **dict.fromkeys(indexed("cable_angle"), "rad"),
    **dict.fromkeys(("ax", "ay"), "m/s2"),
    "alpha": "rad/s2",
    **dict.fromkeys(indexed("winch_angle"), "rad"),
    **dict.fromkeys(indexed("winch_rate"), "rad/s"),
    "platform_mass": "kg",
    "platform_inertia": "kg.m2",
    "anchor_radius": "m",
    "attachment_radius": "m",
    **dict.fromkeys(indexed("anchor_angle"), "rad"),
    **dict.fromkeys(indexed("attachment_angle"), "rad"),
    "cable_density": "kg/m",
    "youngs_modulus": "Pa",
    "cable_area": "m2",
    "cable_damping": "N.s",
    "gravity_x": "m/s2",
    "gravity_y": "m/s2",
    "centre_of_mass_x": "m",
    "centre_of_mass_y": "m",
    "drum_radius": "m",
    "gear_ratio": "1",
}
FIRST_PARAMETER = list(UNITS).index("platform_mass")
PARAMETERS = list(UNITS)[FIRST_PARAMETER:]
STATES = ("x", "y", "phi", "vx", "vy", "omega", *indexed("unstretched_length"))


def test_fmpy_finds_no_problem(fmu):
    assert validate_fmu(str(fmu.path)) == []


def test_description_is_valid_by_the_fmi_schema(fmu):
    schema = etree.XMLSchema(
        etree.parse(str(files("fmpy") / "schema" / "fmi2" / "fmi2ModelDescription.xsd"))
    )
    document = etree.parse(str(fmu.folder / "modelDescription.xml"))
    assert schema.validate(document), schema.error_log


def test_name_and_capabilities(fmu):
    description, cosim = fmu.description, fmu.description.coSimulation
    assert description.fmiVersion == "2.0"
    assert description.modelName == "CablePlatform"
    assert cosim.modelIdentifier == "CablePlatform"
    assert description.variableNamingConvention == "structured"
    assert description.modelExchange is None
    for capability in (
        "canHandleVariableCommunicationStepSize",
        "canInterpolateInputs",
        "canGetAndSetFMUstate",
        "canSerializeFMUstate",
        "providesDirectionalDerivative",
        "canNotUseMemoryManagementFunctions",
    ):
        assert getattr(cosim, capability), capability
    assert cosim.maxOutputDerivativeOrder == 1
    assert not cosim.needsExecutionTool
    assert not cosim.canBeInstantiatedOnlyOncePerProcess
    assert description.guid.strip()


@pytest.mark.parametrize(
    ("causality", "names"),
    [
        ("input", INPUTS),
        ("output", [*list(UNITS)[7:FIRST_PARAMETER], *SLACK]),
        ("parameter", PARAMETERS),
    ],
)
def test_variables_have_their_causality(fmu, causality, names):
    for name in names:
        assert fmu.variables[name].causality == causality, name
    others = {n for n, v in fmu.variables.items() if v.causality == causality} - set(names)
    allowed = {"cable_model", "cable_inertia", "relative_tolerance", "initialization", "solver"}
    assert others <= (allowed if causality == "parameter" else set())


def test_variables_have_their_units(fmu):
    for name, unit in UNITS.items():
        assert fmu.variables[name].unit == unit, name
        assert fmu.variables[name].type == "Real", name
    for name in SLACK:
        assert fmu.variables[name].type == "Boolean"
    units = {u.name: u for u in fmu.description.unitDefinitions}
    assert units["rad"].displayUnits[0].name == "deg"
    for unit in units.values():
        assert unit.baseUnit is not None, unit.name


def test_enumerations_have_the_documented_items(fmu):
    def items(name):
        return [i.name for i in fmu.variables[name].declaredType.items]

    assert items("solver") == ["radau", "dormand_prince", "auto"]
    assert sorted(items("cable_model")) == ["lumped_mass", "massless_spring", "rigid"]
    assert sorted(items("initialization")) == [
        "from_states",
        "from_winch_forces",
        "static_equilibrium",
    ]


def test_defaults_are_those_of_the_paper(fmu):
    default = Parameters()
    for name in ("platform_mass", "platform_inertia", "anchor_radius", "youngs_modulus"):
        assert float(fmu.variables[name].start) == getattr(default, name)
    for i, name in enumerate(indexed("attachment_angle")):
        assert float(fmu.variables[name].start) == default.attachment_angle[i]


def test_every_state_has_its_derivative_in_the_structure(fmu):
    structure = {u.variable.name for u in fmu.description.derivatives}
    for state in STATES:
        derivative = fmu.variables[f"der({state})"]
        assert derivative.causality == "local"
        assert derivative.derivative.name == state
        assert derivative.name in structure
        assert fmu.variables[state].type == "Real"
    # Cables with inertia have the rate as a state of its own.
    assert {f"der({n})" for n in indexed("unstretched_length_rate")} <= structure


def test_dependencies_are_inputs_or_states(fmu):
    states = {u.variable.derivative.name for u in fmu.description.derivatives}
    known = states | {n for n, v in fmu.variables.items() if v.causality == "input"}
    known |= {n for n, v in fmu.variables.items() if v.causality == "independent"}
    for unknown in (*fmu.description.outputs, *fmu.description.derivatives):
        assert unknown.dependencies is not None, unknown.variable.name
        names = {v.name for v in unknown.dependencies}
        assert names <= known, (unknown.variable.name, names - known)
    length = next(u for u in fmu.description.outputs if u.variable.name == "cable_length[1]")
    assert {v.name for v in length.dependencies} == {"x", "y", "phi"}


def test_value_references_are_unique_and_stable(fmu, pack):
    seen = [
        (v.type in ("Integer", "Enumeration"), v.type, v.valueReference)
        for v in (fmu.description.modelVariables)
    ]
    assert len({(v[1] if not v[0] else "Integer", v[2]) for v in seen}) == len(seen)
    other = pack(
        Parameters(
            platform_mass=2000.0,
            effects=(Effect("platform_quadratic_drag", None, {"coefficient": 30.0}),),
        )
    )
    for name, variable in fmu.variables.items():
        assert other.variables[name].valueReference == variable.valueReference, name


def test_guid_changes_with_the_interface_only(fmu, pack):
    dragged = pack(
        Parameters(effects=(Effect("platform_quadratic_drag", None, {"coefficient": 30.0}),))
    )
    assert dragged.description.guid != fmu.description.guid
    assert "effect.platform_quadratic_drag.coefficient" in dragged.variables


def test_archive_holds_what_it_should(fmu):
    with zipfile.ZipFile(fmu.path) as archive:
        names = set(archive.namelist())
        assert archive.testzip() is None
        page = archive.read("documentation/index.html").decode()
    assert {"modelDescription.xml", "resources/model.toml", "documentation/index.html"} <= names
    assert any(n.startswith("binaries/") and "CablePlatform" in n for n in names)
    assert any(n.startswith("documentation/licenses/") for n in names)
    assert "model.png" in names
    assert "winch_force" in page


def test_packing_twice_gives_the_same_bytes(cdpr, tmp_path):
    cdpr("fmu", "-o", tmp_path / "a.fmu")
    cdpr("fmu", "-o", tmp_path / "b.fmu")
    assert (tmp_path / "a.fmu").read_bytes() == (tmp_path / "b.fmu").read_bytes()
