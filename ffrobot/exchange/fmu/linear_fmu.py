"""`ffrobot export --format fmu`: the linear model of an analysis as a functional mock-up unit."""

from __future__ import annotations

import re
import zipfile
from importlib.metadata import version
from io import BytesIO
from pathlib import Path
from uuid import NAMESPACE_URL, uuid5

import numpy as np

from ...actuation.control.linear_model import LinearModel
from ...common.errors import InputError
from ...results.file import Results
from .description import Unit, model_description
from .source import binary, numbers, sources
from .variables import inputs_of, outputs_of, states_of

LONGEST = 60  # characters of a name in the identifier
DATE = (1980, 1, 1, 0, 0, 0)  # of all files in it: the same model is the same FMU, byte for byte


def linear_fmu(path: Path, analysis: str | None) -> tuple[bytes, str, tuple[str, ...]]:
    """The FMU of an analysis of kind "linear", the first if not named; a few words on it, remarks.

    Raises:
        InputError: there is no such analysis, it has several times, or its model has no inputs or is not finite.
    """
    with Results(path) as results:
        name = results.linear_analysis(analysis)
        models, scene = results.linear(name), results.scene
    if len(models) != 1:
        times = f"{len(models)}, from t = {models[0].time:g} s to t = {models[-1].time:g} s"
        raise InputError(
            f"{path}: {name}: expected a linear model of one instant for an FMU, found {times}; solve with one in"
            " `times`"
        )
    model = models[0]
    _check(path, name, model)
    on_ways = frozenset(str(joint["name"]) for joint in scene.get("joint", ()) if joint["type"] == "prismatic")
    unit = make_unit(str(scene["name"]), name, model, on_ways)
    files = sources(unit)
    compiled = binary(unit, files)
    content = {"modelDescription.xml": model_description(unit, f"ffrobot {version('ffrobot')}")}
    content |= {f"sources/{file}": text.encode() for file, text in files.items()}
    remarks = ["all values are deviations from the configuration that the model is about"]
    if isinstance(compiled, str):
        remarks.append(f"sources only, no binary: {compiled}")
    else:
        content[compiled[0]] = compiled[1]
    what = f"{name}, {len(unit.states)} states, {len(unit.inputs)} inputs, {len(unit.outputs)} outputs"
    return _zipped(content), what, tuple(remarks)


def make_unit(scene: str, analysis: str, model: LinearModel, on_ways: frozenset[str]) -> Unit:
    """Names and variables of the FMU of a model; `on_ways` are the joints that slide."""
    plain = re.sub(r"[^A-Za-z0-9_]", "_", f"{scene}_{analysis}")[:LONGEST]
    states, inputs, outputs = (of(model, on_ways) for of in (states_of, inputs_of, outputs_of))
    names = "\n".join(each.name for each in (*states, *inputs, *outputs))
    return Unit(
        identifier=plain if plain[0].isalpha() else f"robot_{plain}"[:LONGEST],
        name=f"{scene}, {analysis}",
        description=f"linear model about t = {model.time:g} s; all values are deviations from the configuration there",
        guid=f"{{{uuid5(NAMESPACE_URL, numbers(model) + names)}}}",
        model=model, states=states, inputs=inputs, outputs=outputs,
    )  # fmt: skip


def _check(path: Path, analysis: str, model: LinearModel) -> None:
    if not (model.input_names and model.output_names):
        raise InputError(
            f"{path}: {analysis}: expected a model with inputs and outputs for an FMU, found {len(model.input_names)}"
            f" inputs and {len(model.output_names)} outputs; motors, patches and loads at points are inputs"
        )
    if not all(np.all(np.isfinite(getattr(model, key))) for key in "ABCD"):
        raise InputError(f"{path}: {analysis}: expected finite matrices A, B, C, D, found others")


def _zipped(content: dict[str, bytes]) -> bytes:
    archive = BytesIO()
    with zipfile.ZipFile(archive, "w", zipfile.ZIP_DEFLATED) as file:
        for name, data in content.items():
            file.writestr(zipfile.ZipInfo(name, DATE), data, zipfile.ZIP_DEFLATED)
    return archive.getvalue()
