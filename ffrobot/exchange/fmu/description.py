"""What FMUs (FMI 2.0) of linear models and forward motions say of themselves, and the archive that they are in."""

from __future__ import annotations

import re
import zipfile
from collections.abc import Iterable, Iterator, Mapping
from dataclasses import dataclass
from functools import cached_property
from io import BytesIO
from itertools import count
from xml.etree import ElementTree

import numpy as np

from ...actuation.control.linear_model import LinearModel
from ...common.arrays import Array
from ...mbs.analysis.forward import Forward
from .forward_model import UNITS, ForwardUnit, Variable

SOURCE = "linear.c"
VIBRATION = 1e-6  # imaginary part of a pole over its size, from which it counts as one


@dataclass(frozen=True)
class Unit:
    """What an FMU says of itself.

    Attributes:
        identifier: of C, in the name of the binary.
        name: for people, with `description`.
        guid: of the model's numbers; the binary has the same.
        states, inputs, outputs: in the order of the rows and columns of `model`.
    """

    identifier: str
    name: str
    description: str
    guid: str
    model: LinearModel
    states: tuple[Variable, ...]
    inputs: tuple[Variable, ...]
    outputs: tuple[Variable, ...]

    @cached_property
    def derivatives(self) -> tuple[Variable, ...]:
        """Of the states."""
        return tuple(
            Variable(f"der({each.name})", f"{each.unit}2" if each.unit.endswith("/s") else f"{each.unit}/s", "")
            for each in self.states
        )

    @property
    def variables(self) -> tuple[Variable, ...]:
        """All, in the order of their value references: states, derivatives, inputs, outputs."""
        return (*self.states, *self.derivatives, *self.inputs, *self.outputs)


def model_description(unit: Unit, generator: str) -> bytes:
    """The file, in UTF-8."""
    root = _root(unit.name, unit.guid, unit.description, generator)
    abilities = {
        "modelIdentifier": unit.identifier, "canNotUseMemoryManagementFunctions": "true",
        "canGetAndSetFMUstate": "true", "providesDirectionalDerivative": "true",
    }  # fmt: skip
    stepping = {"canHandleVariableCommunicationStepSize": "true", "canInterpolateInputs": "true"}
    for kind, more in (("ModelExchange", {"completedIntegratorStepNotNeeded": "true"}), ("CoSimulation", stepping)):
        files = ElementTree.SubElement(ElementTree.SubElement(root, kind, abilities | more), "SourceFiles")
        ElementTree.SubElement(files, "File", name=SOURCE)
    groups = {"states": unit.states, "derivatives": unit.derivatives, "inputs": unit.inputs, "outputs": unit.outputs}
    _add_variables(root, groups, _experiment(unit.model.A))
    _structure(ElementTree.SubElement(root, "ModelStructure"), unit)
    return _text(root)


def forward_description(unit: ForwardUnit, identifier: str, name: str, analysis: Forward, generator: str) -> bytes:
    """That of a forward motion under held inputs, in UTF-8; outputs follow the state alone, no input."""
    about = "motion from the initial state under piecewise constant inputs; gravity and friction act as in the scene"
    root = _root(name, unit.data.guid, about, generator)
    stepping = {
        "canHandleVariableCommunicationStepSize": "true", "canNotUseMemoryManagementFunctions": "true",
        "canGetAndSetFMUstate": "true",
    }  # fmt: skip
    ElementTree.SubElement(root, "CoSimulation", {"modelIdentifier": identifier, **stepping})
    experiment = {"startTime": "0", "stopTime": f"{analysis.last_time:g}", "stepSize": f"{analysis.output_step:g}"}
    _add_variables(root, {"inputs": unit.inputs, "outputs": unit.outputs}, experiment, unit.references)
    structure, first = ElementTree.SubElement(root, "ModelStructure"), len(unit.inputs) + 1
    for group in ("Outputs", "InitialUnknowns"):
        element = ElementTree.SubElement(structure, group)
        for index in range(first, first + len(unit.outputs)):
            ElementTree.SubElement(element, "Unknown", index=str(index), dependencies="")
    return _text(root)


def _root(name: str, guid: str, description: str, generator: str) -> ElementTree.Element:
    return ElementTree.Element(
        "fmiModelDescription", fmiVersion="2.0", modelName=name, guid=guid, description=description,
        generationTool=generator, variableNamingConvention="flat", numberOfEventIndicators="0",
    )  # fmt: skip


def _text(root: ElementTree.Element) -> bytes:
    ElementTree.indent(root)
    text: bytes = ElementTree.tostring(root, encoding="UTF-8", xml_declaration=True)
    return text + b"\n"


def _add_variables(
    root: ElementTree.Element,
    groups: Mapping[str, tuple[Variable, ...]],
    experiment: dict[str, str],
    references: Iterable[int] | None = None,
) -> None:
    """Units, log, experiment and variables, in the order that FMI wants; `references`: of variables, or 0, 1, 2, …."""
    definitions, used = ElementTree.SubElement(root, "UnitDefinitions"), {v.unit for of in groups.values() for v in of}
    for name, exponents in UNITS.items():
        if name in used:
            definition = ElementTree.SubElement(definitions, "Unit", name=name)
            if exponents:
                ElementTree.SubElement(definition, "BaseUnit", {key: str(n) for key, n in exponents.items()})
    ElementTree.SubElement(ElementTree.SubElement(root, "LogCategories"), "Category", name="logStatusError")
    ElementTree.SubElement(root, "DefaultExperiment", experiment)
    numbers = count() if references is None else iter(references)
    _variables(ElementTree.SubElement(root, "ModelVariables"), groups, numbers)


def _experiment(A: Array) -> dict[str, str]:
    """Ten periods of the slowest vibration in a thousand steps; a second where there is none."""
    poles = np.linalg.eigvals(A)
    angular = np.abs(poles.imag)
    vibrations = angular[angular > VIBRATION * max(np.abs(poles).max(), 1.0)]
    stop = float(f"{10 * 2 * np.pi / vibrations.min():.1g}") if len(vibrations) else 1.0
    return {"startTime": "0", "stopTime": f"{stop:g}", "stepSize": f"{stop / 1000:g}"}


def _variables(
    parent: ElementTree.Element, groups: Mapping[str, tuple[Variable, ...]], references: Iterator[int]
) -> None:
    attributes: Mapping[str, Mapping[str, str]] = {
        "states": {"causality": "local", "initial": "exact"},
        "derivatives": {"causality": "local", "initial": "calculated"},
        "inputs": {"causality": "input"},
        "outputs": {"causality": "output", "initial": "calculated"},
    }
    for group, variables in groups.items():
        fixed = attributes[group]
        for k, each in enumerate(variables, 1):
            words = {"description": each.description} if each.description else {}
            number = {"valueReference": str(next(references))}
            named = {"name": each.name, **number, **words, "variability": "continuous", **fixed}
            variable = ElementTree.SubElement(parent, "ScalarVariable", named)
            real = ElementTree.SubElement(variable, "Real", unit=each.unit)
            if group in ("states", "inputs"):
                real.set("start", "0")
            if group == "derivatives":
                real.set("derivative", str(k))  # states are the first variables


def _structure(parent: ElementTree.Element, unit: Unit) -> None:
    model, f = unit.model, len(unit.states)
    # FMI counts variables from 1; columns of [A B] and [C D] are states, then inputs.
    columns = np.array([*range(1, f + 1), *range(2 * f + 1, 2 * f + 1 + len(unit.inputs))])
    outputs = _unknowns(2 * f + 1 + len(unit.inputs), np.hstack([model.C, model.D]), columns)
    derivatives = _unknowns(f + 1, np.hstack([model.A, model.B]), columns)
    groups = {"Outputs": outputs, "Derivatives": derivatives, "InitialUnknowns": sorted([*derivatives, *outputs])}
    for group, unknowns in groups.items():
        element = ElementTree.SubElement(parent, group)
        for index, dependencies in unknowns:
            on = " ".join(map(str, dependencies))
            ElementTree.SubElement(element, "Unknown", index=str(index), dependencies=on)


def _unknowns(first: int, matrix: Array, columns: Array) -> list[tuple[int, Iterable[int]]]:
    return [(first + k, columns[row != 0].tolist()) for k, row in enumerate(matrix)]


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


def identifier_of(scene: str, analysis: str) -> str:
    """Of C, and in the name of the binary."""
    plain = re.sub(r"[^A-Za-z0-9_]", "_", f"{scene}_{analysis}")[:LONGEST]
    return plain if plain[0].isalpha() else f"robot_{plain}"[:LONGEST]


def zipped(content: Mapping[str, bytes]) -> bytes:
    """Files by name in one archive."""
    archive = BytesIO()
    with zipfile.ZipFile(archive, "w", zipfile.ZIP_DEFLATED) as file:
        for name, data in content.items():
            file.writestr(zipfile.ZipInfo(name, DATE), data, zipfile.ZIP_DEFLATED)
    return archive.getvalue()
