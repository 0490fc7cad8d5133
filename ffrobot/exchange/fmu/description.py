"""Model description and archive of FMUs (FMI 2.0)."""

import platform
import re
import sys
import zipfile
from collections.abc import Iterable, Mapping
from io import BytesIO
from uuid import NAMESPACE_URL, uuid5
from xml.etree import ElementTree

from ...common.errors import InputError
from ...common.structs import struct
from ...common.version import VERSION

Element = ElementTree.Element
add = ElementTree.SubElement

UNITS: Mapping[str, Mapping[str, int]] = {
    "1": {},
    "rad": {"rad": 1},
    "m": {"m": 1},
    "rad/s": {"rad": 1, "s": -1},
    "m/s": {"m": 1, "s": -1},
    "rad/s2": {"rad": 1, "s": -2},
    "m/s2": {"m": 1, "s": -2},
    "N": {"kg": 1, "m": 1, "s": -2},
    "N.m": {"kg": 1, "m": 2, "s": -2},
    "V": {"kg": 1, "m": 2, "s": -3, "A": -1},
    "kg0.5.m": {},
    "kg0.5.m/s": {},
    "kg0.5.m/s2": {},
}
"""Exponents of SI base units; none for modal coordinates, since FMI has no fractional exponents."""


@struct
class Variable:
    """Variable of an FMU: name as in results, unit (a key of `UNITS`) and description."""

    name: str
    unit: str
    description: str


def motor(name: str, unit: str) -> Variable:
    """Return the input variable of the motor of a joint coordinate in "rad" or "m": torque N·m, or force N."""
    what, of_force = ("force", "N") if unit == "m" else ("moment", "N.m")
    return Variable(f"joint/{name}/moment", of_force, f"{what} of the motor of {name}")


def voltage(layout: str, number: int) -> Variable:
    """Return the input variable, V, of patch `number` (from 1) of a patch layout."""
    return Variable(f"pzt/{layout}/{number}", "V", f"voltage of patch {number} of {layout}")


def numbered(joint: str, number: int, count: int) -> str:
    """Name of coordinate `number`, from 1, of a joint that has `count`: "NAME", or "NAME 1" where it has several."""
    return f"{joint} {number}" if count > 1 else joint


def new_root(name: str, guid: str, about: str) -> Element:
    """Return an empty root element of a model description, with the description `about`."""
    return Element(
        "fmiModelDescription", fmiVersion="2.0", modelName=name, guid=guid, description=about,
        generationTool=f"ffrobot {VERSION}", variableNamingConvention="flat", numberOfEventIndicators="0",
    )  # fmt: skip


ATTRIBUTES: Mapping[str, Mapping[str, str]] = {
    "states": {"causality": "local", "initial": "exact"},
    "derivatives": {"causality": "local", "initial": "calculated"},
    "inputs": {"causality": "input"},
    "outputs": {"causality": "output", "initial": "calculated"},
}
"""FMI's attributes of the variables of each group."""


def finished(
    root: Element,
    groups: Mapping[str, tuple[Variable, ...]],
    experiment: dict[str, str],
    references: Iterable[int],
    structure: Mapping[str, Mapping[int, list[int]]],
) -> bytes:
    """Return modelDescription.xml (UTF-8): `root` with units, log, experiment, variables and structure added.

    `groups`: variables by the keys of `ATTRIBUTES`. `references`: value references of all variables in order.
    `structure`: dependencies of variables by element of <ModelStructure>; numbers of variables from 1.
    """
    definitions, units = add(root, "UnitDefinitions"), {one.unit for group in groups.values() for one in group}
    for name, exponents in UNITS.items():
        if name in units:
            definition = add(definitions, "Unit", {"name": name})
            if exponents:
                add(definition, "BaseUnit", {key: str(n) for key, n in exponents.items()})
    add(add(root, "LogCategories"), "Category", {"name": "logStatusError"})
    add(root, "DefaultExperiment", experiment)
    variables, numbers = add(root, "ModelVariables"), iter(references)
    for group, members in groups.items():
        for k, each in enumerate(members, 1):
            attributes = {"name": each.name, "valueReference": str(next(numbers))}
            if each.description:
                attributes["description"] = each.description
            variable = add(
                variables, "ScalarVariable", {**attributes, "variability": "continuous", **ATTRIBUTES[group]}
            )
            real = add(variable, "Real", {"unit": each.unit})
            if group in ("states", "inputs"):
                real.set("start", "0")
            if group == "derivatives":
                real.set("derivative", str(k))  # states are the first variables
    parent = add(root, "ModelStructure")
    for group, unknowns in structure.items():
        element = add(parent, group)
        for index, dependencies in sorted(unknowns.items()):
            add(element, "Unknown", {"index": str(index), "dependencies": " ".join(map(str, dependencies))})
    ElementTree.indent(root)
    text: bytes = ElementTree.tostring(root, encoding="UTF-8", xml_declaration=True)
    return text + b"\n"


LONGEST = 60  # characters of a name in the identifier
DATE = (1980, 1, 1, 0, 0, 0)  # of all files in it: the same model is the same FMU, byte for byte
PLATFORMS: Mapping[tuple[str, str], tuple[str, str]] = {
    ("linux", "x86_64"): ("linux64", ".so"),
    ("linux", "i686"): ("linux32", ".so"),
    ("darwin", "x86_64"): ("darwin64", ".dylib"),
    ("darwin", "arm64"): ("darwin64", ".dylib"),
    ("win32", "AMD64"): ("win64", ".dll"),
}
"""By `sys.platform` and processor: FMI 2.0's name of the platform, and the end of a library's name there."""


def platform_here() -> tuple[str, str]:
    """Return this machine's entry of `PLATFORMS`. Raises `InputError` if FMI 2.0 has no name for it."""
    here = sys.platform, platform.machine()
    if here not in PLATFORMS:
        raise InputError(f"--format fmu: FMI 2.0 has no name for {here[0]} on {here[1]}")
    return PLATFORMS[here]


def guid_of(numbers: str, variables: Iterable[Variable]) -> str:
    """Return the GUID of a model: a hash of its `numbers` as text and of the names of its variables."""
    names = "\n".join(each.name for each in variables)
    return f"{{{uuid5(NAMESPACE_URL, numbers + names)}}}"


def identifier_of(scene: str, analysis: str) -> str:
    """Return a C identifier from both names, which also names the FMU's library."""
    plain = re.sub(r"[^A-Za-z0-9_]", "_", f"{scene}_{analysis}")[:LONGEST]
    return plain if plain[0].isalpha() else f"robot_{plain}"[:LONGEST]


def zipped(content: Mapping[str, bytes]) -> bytes:
    """Return the ZIP archive of files by name."""
    archive = BytesIO()
    with zipfile.ZipFile(archive, "w", zipfile.ZIP_DEFLATED) as file:
        for name, data in content.items():
            file.writestr(zipfile.ZipInfo(name, DATE), data, zipfile.ZIP_DEFLATED)
    return archive.getvalue()
