"""What FMUs (FMI 2.0) of linear models and forward motions say of themselves, and the archive that they are in."""

from __future__ import annotations

import re
import zipfile
from collections.abc import Iterable, Mapping
from dataclasses import dataclass
from io import BytesIO
from uuid import NAMESPACE_URL, uuid5
from xml.etree import ElementTree

import numpy as np

from ...actuation.control.linear_model import StateSpace
from ...common.arrays import Array
from ...mbs.analysis.forward import Forward
from .forward_model import UNITS, ForwardUnit, Variable

Element = ElementTree.Element
_add = ElementTree.SubElement

SOURCE = "linear.c"
VIBRATION = 1e-6  # imaginary part of a pole over its size, from which it counts as one


@dataclass(frozen=True)
class Unit:
    """Names, variables and model of an FMU, for its description."""

    identifier: str  # of C, in the name of the binary
    name: str  # for people, with `description`
    description: str
    guid: str  # of the model's numbers; the binary has the same
    model: StateSpace
    # states, inputs, outputs: in the order of the rows and columns of `model`
    states: tuple[Variable, ...]
    inputs: tuple[Variable, ...]
    outputs: tuple[Variable, ...]


def model_description(unit: Unit, generator: str) -> bytes:
    """The file, in UTF-8; value references are 0, 1, … of states, derivatives, inputs, outputs."""
    abilities = {
        "modelIdentifier": unit.identifier,
        "canNotUseMemoryManagementFunctions": "true",
        "canGetAndSetFMUstate": "true",
        "providesDirectionalDerivative": "true",
    }
    model, f, u, is_sampled = unit.model, len(unit.states), len(unit.inputs), unit.model.step > 0.0
    stepping = {"canHandleVariableCommunicationStepSize": "true", "canInterpolateInputs": "true"}
    kinds = {
        "ModelExchange": abilities | {"completedIntegratorStepNotNeeded": "true"},
        "CoSimulation": abilities | stepping,
    }
    derivatives = tuple(
        Variable(f"der({each.name})", f"{each.unit}2" if each.unit.endswith("/s") else f"{each.unit}/s", "")
        for each in unit.states
    )
    groups = {"states": unit.states, "derivatives": derivatives, "inputs": unit.inputs, "outputs": unit.outputs}
    references, experiment = list(range(2 * f + u + len(unit.outputs))), _experiment(model)
    if is_sampled:
        kinds = {"CoSimulation": abilities}
        del groups["derivatives"], references[f : 2 * f]
    first = sum(len(group) for group in groups.values()) - len(unit.outputs) + 1
    # FMI counts variables from 1; columns of [A B] and [C D] are states, then inputs.
    columns = np.array([*range(1, f + 1), *range(first - u, first)])

    def unknowns(first: int, matrix: Array) -> dict[int, list[int]]:
        return {first + k: columns[row != 0].tolist() for k, row in enumerate(matrix)}

    outputs = unknowns(first, np.hstack([model.C, model.D]))
    rates = {} if is_sampled else unknowns(f + 1, np.hstack([model.A, model.B]))
    structure = {"Outputs": outputs} | ({"Derivatives": rates} if rates else {}) | {"InitialUnknowns": rates | outputs}
    root = _root(unit.name, unit.guid, unit.description, generator)
    for kind, attributes in kinds.items():
        _add(_add(_add(root, kind, attributes), "SourceFiles"), "File", {"name": SOURCE})
    return _finished(root, groups, experiment, references, structure)


def forward_description(unit: ForwardUnit, identifier: str, name: str, analysis: Forward, generator: str) -> bytes:
    """Return the model description (UTF-8) of a forward motion under held inputs; outputs follow the state."""
    about = "motion from the initial state under piecewise constant inputs; gravity and friction act as in the scene"
    root = _root(name, unit.data.guid, about, generator)
    _add(
        root,
        "CoSimulation",
        modelIdentifier=identifier,
        canHandleVariableCommunicationStepSize="true",
        canNotUseMemoryManagementFunctions="true",
        canGetAndSetFMUstate="true",
    )
    experiment = {"startTime": "0", "stopTime": f"{analysis.last_time:g}", "stepSize": f"{analysis.output_step:g}"}
    unknowns: dict[int, list[int]] = {len(unit.inputs) + k: [] for k in range(1, len(unit.outputs) + 1)}
    groups = {"inputs": unit.inputs, "outputs": unit.outputs}
    structure = {"Outputs": unknowns, "InitialUnknowns": unknowns}
    return _finished(root, groups, experiment, unit.references, structure)


def _root(name: str, guid: str, description: str, generator: str) -> Element:
    return Element(
        "fmiModelDescription", fmiVersion="2.0", modelName=name, guid=guid, description=description,
        generationTool=generator, variableNamingConvention="flat", numberOfEventIndicators="0",
    )  # fmt: skip


ATTRIBUTES: Mapping[str, Mapping[str, str]] = {
    "states": {"causality": "local", "initial": "exact"},
    "derivatives": {"causality": "local", "initial": "calculated"},
    "inputs": {"causality": "input"},
    "outputs": {"causality": "output", "initial": "calculated"},
}
"""Of the variables of each group."""


def _finished(
    root: Element,
    groups: Mapping[str, tuple[Variable, ...]],
    experiment: dict[str, str],
    references: Iterable[int],
    structure: Mapping[str, Mapping[int, list[int]]],
) -> bytes:
    """The file with units, log, experiment, variables and structure, in the order that FMI wants.

    `references` are those of the variables; `structure` has by group the dependencies of variables, from 1.
    """
    definitions, units = _add(root, "UnitDefinitions"), {one.unit for group in groups.values() for one in group}
    for name, exponents in UNITS.items():
        if name in units:
            definition = _add(definitions, "Unit", {"name": name})
            if exponents:
                _add(definition, "BaseUnit", {key: str(n) for key, n in exponents.items()})
    _add(_add(root, "LogCategories"), "Category", {"name": "logStatusError"})
    _add(root, "DefaultExperiment", experiment)
    variables, numbers = _add(root, "ModelVariables"), iter(references)
    for group, members in groups.items():
        for k, each in enumerate(members, 1):
            attributes = {"name": each.name, "valueReference": str(next(numbers))}
            if each.description:
                attributes["description"] = each.description
            variable = _add(
                variables, "ScalarVariable", {**attributes, "variability": "continuous", **ATTRIBUTES[group]}
            )
            real = _add(variable, "Real", {"unit": each.unit})
            if group in ("states", "inputs"):
                real.set("start", "0")
            if group == "derivatives":
                real.set("derivative", str(k))  # states are the first variables
    parent = _add(root, "ModelStructure")
    for group, unknowns in structure.items():
        element = _add(parent, group)
        for index, dependencies in sorted(unknowns.items()):
            _add(element, "Unknown", {"index": str(index), "dependencies": " ".join(map(str, dependencies))})
    ElementTree.indent(root)
    text: bytes = ElementTree.tostring(root, encoding="UTF-8", xml_declaration=True)
    return text + b"\n"


def _experiment(model: StateSpace) -> dict[str, str]:
    """Ten periods of the slowest vibration in a thousand steps; a second where there is none, or of samples."""
    if model.step:
        return {"startTime": "0", "stopTime": "1", "stepSize": repr(model.step)}
    poles = np.linalg.eigvals(model.A)
    angular = np.abs(poles.imag)
    vibrations = angular[angular > VIBRATION * np.abs(poles).max()]
    stop = float(f"{10 * 2 * np.pi / vibrations.min():.1g}") if len(vibrations) else 1.0
    return {"startTime": "0", "stopTime": f"{stop:g}", "stepSize": f"{stop / 1000:g}"}


LONGEST = 60  # characters of a name in the identifier
DATE = (1980, 1, 1, 0, 0, 0)  # of all files in it: the same model is the same FMU, byte for byte
PLATFORMS: Mapping[tuple[str, str], tuple[str, str]] = {
    ("linux", "x86_64"): ("linux64", ".so"),
    ("linux", "i686"): ("linux32", ".so"),
    ("darwin", "x86_64"): ("darwin64", ".dylib"),
    ("darwin", "arm64"): ("darwin64", ".dylib"),
    ("win32", "AMD64"): ("win64", ".dll"),
}
"""By system and processor: FMI 2.0's name of the platform, and the end of a library's name there."""


def guid_of(numbers: str, variables: Iterable[Variable]) -> str:
    """Return the same for the same numbers and names of variables."""
    names = "\n".join(each.name for each in variables)
    return f"{{{uuid5(NAMESPACE_URL, numbers + names)}}}"


def identifier_of(scene: str, analysis: str) -> str:
    """Return an identifier valid in C, also used in the name of the binary."""
    plain = re.sub(r"[^A-Za-z0-9_]", "_", f"{scene}_{analysis}")[:LONGEST]
    return plain if plain[0].isalpha() else f"robot_{plain}"[:LONGEST]


def zipped(content: Mapping[str, bytes]) -> bytes:
    """ZIP archive of files by name."""
    archive = BytesIO()
    with zipfile.ZipFile(archive, "w", zipfile.ZIP_DEFLATED) as file:
        for name, data in content.items():
            file.writestr(zipfile.ZipInfo(name, DATE), data, zipfile.ZIP_DEFLATED)
    return archive.getvalue()
