"""`ffrobot export --format fmu`: the linear model of an analysis as a functional mock-up unit."""

from __future__ import annotations

from collections.abc import Mapping
from importlib.metadata import version
from pathlib import Path
from uuid import NAMESPACE_URL, uuid5

import numpy as np

from ...actuation.control.linear_model import LinearModel
from ...common.errors import InputError
from ...results.file import Results
from .archive import identifier_of, zipped
from .description import Unit, model_description
from .source import binary, numbers, sources
from .variables import inputs_of, joint_units, outputs_of, states_of


def linear_fmu(path: Path, analysis: str | None) -> tuple[bytes, str, str, tuple[str, ...]]:
    """The FMU of an analysis of kind "linear", the first if not named; its name, a few words on it, remarks.

    Raises:
        InputError: there is no such analysis, it has several times, or its model has no inputs or is not finite.
    """
    with Results(path) as results:
        name = results.linear_analysis(analysis)
        if name in results.analyses and results.attributes(name)["kind"] == "forward":
            raise InputError(
                f'{path}: --analysis: expected a linear analysis of results, found "{name}" of kind "forward": export'
                " the scene, SCENE.toml, for an FMU of that motion"
            )
        models, scene = results.linear(name), results.scene
    if len(models) != 1:
        times = f"{len(models)}, from t = {models[0].time:g} s to t = {models[-1].time:g} s"
        raise InputError(
            f"{path}: {name}: expected a linear model of one instant for an FMU, found {times}; solve with one in"
            " `times`"
        )
    model = models[0]
    _check(path, name, model)
    unit = make_unit(str(scene["name"]), name, model, joint_units(scene))
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
    return zipped(content), name, what, tuple(remarks)


def make_unit(scene: str, analysis: str, model: LinearModel, units: Mapping[str, str]) -> Unit:
    """Names and variables of the FMU of a model; `units` of the joints' coordinates."""
    states, inputs, outputs = (of(model, units) for of in (states_of, inputs_of, outputs_of))
    names = "\n".join(each.name for each in (*states, *inputs, *outputs))
    return Unit(
        identifier=identifier_of(scene, analysis),
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
