"""`ffrobot export`: the linear model of an analysis, or the controller of a loop, as an FMU or as numbers in C."""

from __future__ import annotations

import os
import platform
import shlex
import shutil
import subprocess
import sys
import tempfile
from collections.abc import Mapping, Sequence
from dataclasses import replace
from pathlib import Path

import numpy as np
from scipy.linalg import matrix_balance

from ...actuation.control.linear_model import LinearModel, StateSpace
from ...common.arrays import Array
from ...common.errors import InputError
from ...common.version import VERSION
from ...results.file import Results
from .description import PLATFORMS, SOURCE, Unit, guid_of, identifier_of, model_description, zipped
from .forward_model import joint_units, linear_variables


def linear_fmu(path: Path, analysis: str | None) -> tuple[bytes, str, tuple[str, ...], str]:
    """The FMU of an analysis with linear models, the first if not named; a few words on it, remarks, its name.

    Raises:
        InputError: there is no such analysis, it has several times, or its model has no inputs or is not finite.
    """
    unit, models, remarks, name = _unit(path, analysis)
    if len(models) > 1:
        remarks.append(f"the controllers at {models[0].time:g} s; --format c has all of their schedule")
    source = (Path(__file__).parent / "c" / SOURCE).read_text(encoding="utf-8")
    files = {SOURCE: source, HEADER: _header(unit, models[:1])}
    compiled = binary(unit, files)
    content = {"modelDescription.xml": model_description(unit, f"ffrobot {VERSION}")}
    content |= {f"sources/{file}": text.encode() for file, text in files.items()}
    if isinstance(compiled, str):
        remarks.append(f"sources only, no binary: {compiled}")
    else:
        content[compiled[0]] = compiled[1]
    return zipped(content), _what(name, unit), tuple(remarks), name


def c_table(path: Path, analysis: str | None) -> tuple[str, str, tuple[str, ...], str]:
    """Return a C header with the matrices, of all instants of a schedule; arguments as of `linear_fmu`."""
    unit, models, remarks, name = _unit(path, analysis)
    return _header(unit, models), _what(name, unit), tuple(remarks), name


def _what(analysis: str, unit: Unit) -> str:
    return f"{analysis}, {len(unit.states)} states, {len(unit.inputs)} inputs, {len(unit.outputs)} outputs"


def _unit(path: Path, analysis: str | None) -> tuple[Unit, list[StateSpace], list[str], str]:
    with Results(path) as results:
        name = results.linear_analysis(analysis)
        if name in results.analyses and results.attributes(name)["kind"] == "forward":
            raise InputError(
                f"{path}: --analysis: expected a linear analysis of results",
                f'"{name}" of kind "forward": export the scene, SCENE.toml, for an FMU of that motion',
            )
        models, scene = results.state_spaces(name), results.scene
    if len(models) != 1 and not models[0].step:
        raise InputError(
            f"{path}: {name}: expected a linear model of one instant", f"{len(models)}; solve with one in `times`"
        )
    _check(path, name, models[0])
    model = models[0]
    if not len(model.A):  # C has no arrays without numbers
        B, C = np.zeros((1, model.B.shape[1])), np.zeros((len(model.C), 1))
        model = replace(model, A=np.zeros((1, 1)), B=B, C=C, state_names=("state/1",))
    unit = make_unit(str(scene["name"]), name, model, joint_units(scene))
    remark = "all values are deviations from the configuration that the model is about"
    if model.step:
        remark = f"a step of {model.step:g} s; readings and commands are off those of the reference"
    return unit, [model, *models[1:]], [remark], name


def make_unit(scene: str, analysis: str, model: StateSpace, units: Mapping[str, str]) -> Unit:
    """Names and variables of the FMU of a model; `units` of the joints' coordinates."""
    states, inputs, outputs = linear_variables(model, units)
    return Unit(
        identifier=identifier_of(scene, analysis),
        name=f"{scene}, {analysis}",
        description=(
            f"linear model about t = {model.time:g} s; all values are deviations from the configuration there"
            if isinstance(model, LinearModel)
            else "controllers and observer at the start, from readings to commands, both off the reference"
        ),
        guid=guid_of(numbers([model]), (*states, *inputs, *outputs)),
        model=model,
        states=states,
        inputs=inputs,
        outputs=outputs,
    )


def _check(path: Path, analysis: str, model: StateSpace) -> None:
    if not (model.input_names and model.output_names):
        raise InputError(
            f"{path}: {analysis}: expected a model with inputs and outputs for an FMU",
            f"{len(model.input_names)} inputs and {len(model.output_names)} outputs; motors, patches and loads at"
            " points are inputs",
        )
    if not all(np.all(np.isfinite(getattr(model, key))) for key in "ABCD"):
        raise InputError(f"{path}: {analysis}: expected finite matrices A, B, C, D", "others")


HEADER = "model.h"
COMPILERS = ("cc", "gcc", "clang")


def numbers(models: Sequence[StateSpace]) -> str:
    """Return the matrices as C source, those of several models one below the other, and a scale that balances A."""
    _, (scale, _) = matrix_balance(models[0].A, permute=False, separate=True)
    arrays = {key: np.vstack([getattr(of, key) for of in models]) for key in "ABCD"} | {"SCALE": scale[None, :]}
    return "\n".join(_array(name, values) for name, values in arrays.items())


def _header(unit: Unit, models: Sequence[StateSpace]) -> str:
    sizes = {"N_X": unit.states, "N_U": unit.inputs, "N_Y": unit.outputs}
    lines = [f"/* {_comment(unit.name)}: {_comment(unit.description)} */", f'#define GUID "{unit.guid}"']
    lines += [f"#define {name} {len(variables)}" for name, variables in sizes.items()]
    lines += [f"#define SAMPLE_TIME {unit.model.step!r} /* s; x(k+1) = A x + B u, y = C x + D u */"] * bool(
        unit.model.step
    )
    for title, variables in zip(("States", "Inputs", "Outputs"), sizes.values(), strict=True):
        names = "\n".join(f"     {_comment(each.name)} ({each.unit})" for each in variables)
        lines += ["", f"/* {title}:\n{names} */"]
    if len(models) > 1:
        lines += ["", f"/* Each of A to D {len(models)} times, for TIME (s); straight lines between */"]
        lines += [f"#define N_TIME {len(models)}", _array("TIME", np.array([[of.time for of in models]]))]
    return "\n".join([*lines, "", numbers(models), ""])


def _comment(text: str) -> str:
    return text.replace("*/", "* /").replace("/*", "/ *")


def _array(name: str, values: Array) -> str:
    rows = ",\n".join("    " + ", ".join(np.format_float_scientific(x, trim="0") for x in row) for row in values)
    return f"static const double {name}[] = {{\n{rows}}};\n"


def binary(unit: Unit, files: Mapping[str, str]) -> tuple[str, bytes] | str:
    """Compile the FMU's library for this platform: its path within the FMU and content, or the reason for none.

    It is compiled by the environment's CC, else by the first of `COMPILERS` on the path.
    """
    place = PLATFORMS.get((sys.platform, platform.machine()))
    if place is None:
        return f"FMI 2.0 has no name for {sys.platform} on {platform.machine()}"
    compiler = shlex.split(os.environ.get("CC", "")) or [name for name in COMPILERS if shutil.which(name)][:1]
    if not compiler:
        return f"found no C compiler ({', '.join(COMPILERS)}, or what CC names)"
    folder, suffix = place
    with tempfile.TemporaryDirectory(prefix="ffrobot-fmu-") as temporary:
        for name, text in files.items():
            (Path(temporary) / name).write_text(text, encoding="utf-8")
        output = f"{unit.identifier}{suffix}"
        command = [*compiler, "-std=c99", "-O2", "-fPIC", "-shared", "-o", output, SOURCE, "-lm"]
        try:
            done = subprocess.run(command, cwd=temporary, capture_output=True, text=True, check=False)
        except OSError as error:
            return f"{shlex.join(compiler)} does not run: {error.strerror or error}"
        if done.returncode:
            reason = (done.stderr.strip() or done.stdout.strip() or "no message").splitlines()[-1]
            return f"{shlex.join(compiler)} failed: {reason}"
        return f"binaries/{folder}/{output}", (Path(temporary) / output).read_bytes()
