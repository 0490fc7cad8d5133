"""`ffrobot export`: the linear model of an analysis, or its controllers, as an FMU or as numbers in C."""

import os
import shlex
import shutil
import subprocess
import tempfile
from collections.abc import Mapping, Sequence
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
from scipy.linalg import matrix_balance

from ...actuation.control.linear_model import LinearModel, StateSpace
from ...actuation.control.signals import ORDERS
from ...common.arrays import Array
from ...common.errors import InputError
from ...common.structs import struct
from ...mbs.joints.joints import JOINT_TYPES, FreeJoint
from ...results.file import Results
from .description import (
    Variable,
    add,
    finished,
    guid_of,
    identifier_of,
    motor,
    new_root,
    numbered,
    platform_here,
    voltage,
    zipped,
)


@struct
class Unit:
    """A linear model as an FMU: names, variables, matrices."""

    identifier: str  # in C, and name of the library
    name: str  # displayed, as `description`
    description: str
    guid: str  # of the model's numbers; the library has the same
    model: StateSpace
    # states, inputs, outputs: in the order of the rows and columns of `model`
    states: tuple[Variable, ...]
    inputs: tuple[Variable, ...]
    outputs: tuple[Variable, ...]


def linear_fmu(path: Path, analysis: str | None) -> tuple[bytes, str, tuple[str, ...], str]:
    """Return the FMU of an analysis with linear models (default: the first), a summary, remarks, the analysis' name.

    Raises `InputError` where there is no such model.
    """
    unit, models, remarks, name = _unit(path, analysis)
    if len(models) > 1:
        remarks.append(f"the controllers at {models[0].time:g} s; --format c has all of their schedule")
    source = (Path(__file__).parent / "c" / SOURCE).read_text(encoding="utf-8")
    files = {SOURCE: source, "model.h": _header(unit, models[:1])}
    content = {"modelDescription.xml": _model_description(unit)}
    content |= {f"sources/{file}": text.encode() for file, text in files.items()}
    compiled = _binary(unit, files)
    if isinstance(compiled, str):
        remarks.append(f"sources only, no binary: {compiled}")
    else:
        content |= compiled
    return zipped(content), _what(name, unit), tuple(remarks), name


def c_table(path: Path, analysis: str | None) -> tuple[str, str, tuple[str, ...], str]:
    """Return a C header with A, B, C, D of an analysis (default: the first), a summary, remarks, the analysis' name."""
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
    model = models[0]
    if len(models) != 1 and not model.step:
        raise InputError(
            f"{path}: {name}: expected a linear model of one instant", f"{len(models)}; solve with one in `times`"
        )
    if not (model.input_names and model.output_names):
        raise InputError(
            f"{path}: {name}: expected a model with inputs and outputs for an FMU",
            f"{len(model.input_names)} inputs and {len(model.output_names)} outputs; motors, patches and loads at"
            " points are inputs",
        )
    if not all(np.all(np.isfinite(getattr(model, key))) for key in "ABCD"):
        raise InputError(f"{path}: {name}: expected finite matrices A, B, C, D", "others")
    if not len(model.A):  # C has no arrays without numbers
        B, C = np.zeros((1, model.B.shape[1])), np.zeros((len(model.C), 1))
        model = replace(model, A=np.zeros((1, 1)), B=B, C=C, state_names=("state/1",))
    unit = make_unit(str(scene["name"]), name, model, joint_units(scene))
    remark = "all values are deviations from the configuration that the model is about"
    if model.step:
        remark = f"a step of {model.step:g} s; readings and commands are off those of the reference"
    return unit, [model, *models[1:]], [remark], name


def make_unit(scene: str, analysis: str, model: StateSpace, units: Mapping[str, str]) -> Unit:
    """Return the FMU's names, variables and matrices of a model; `units`: "rad" or "m" by joint coordinate."""
    states, inputs, outputs = linear_variables(model, units)
    return Unit(
        identifier=identifier_of(scene, analysis),
        name=f"{scene}, {analysis}",
        description=(
            f"linear model about t = {model.time:g} s; all values are deviations from the configuration there"
            if isinstance(model, LinearModel)
            else "controllers and observer at the start, from readings to commands, both off the reference"
        ),
        guid=guid_of(_numbers([model]), (*states, *inputs, *outputs)),
        model=model,
        states=states,
        inputs=inputs,
        outputs=outputs,
    )


RATE = "rate of "


def joint_units(scene: Mapping[str, Any]) -> dict[str, str]:
    """Return "rad" or "m" of each joint coordinate of a scene, by name ("JOINT", or "JOINT 1" of several)."""
    units = dict[str, str]()
    for joint in scene.get("joint", ()):
        record = JOINT_TYPES[joint["type"]]  # types that the plane has too have the same units there
        of_joint = record.units or record.guess_units
        units |= {numbered(joint["name"], k, len(of_joint)): unit for k, unit in enumerate(of_joint, 1)}
    return units


def linear_variables(
    model: StateSpace, units: Mapping[str, str]
) -> tuple[tuple[Variable, ...], tuple[Variable, ...], tuple[Variable, ...]]:
    """Return variables of states, inputs and outputs; `units`: "rad" or "m" by joint coordinate.

    Names in FMUs are unique: a motor is "joint/NAME/moment", as "joint/NAME" is an output; a state with the name of
    an output has the prefix "state ", a sensor patch "measured ".
    """
    seen, driven = model.output_names, model.input_names
    if model.step:  # a controller reads, and commands
        seen, driven = driven, seen
    readings = tuple(
        Variable(f"measured {name}" if name.startswith("pzt/") else name, *_coordinate(name, units)) for name in seen
    )
    acting, states = tuple(_input(name, units) for name in driven), []
    for name in model.state_names:
        unit, about = _coordinate(name.removeprefix(RATE), units)
        if name.startswith(RATE):
            unit, about = f"{unit}/s", f"rate of the {about}"
        states.append(Variable(f"state {name}" if name in model.output_names else name, unit, about))
    return (tuple(states), readings, acting) if model.step else (tuple(states), acting, readings)


def _input(name: str, units: Mapping[str, str]) -> Variable:
    kind, _, rest = name.partition("/")
    if kind == "joint":
        return motor(rest, units[rest])
    place, _, last = rest.rpartition("/")
    if kind == "pzt":
        return voltage(place, int(last))
    return Variable(name, "N", f"force on {place} along {last}")


def _coordinate(name: str, units: Mapping[str, str]) -> tuple[str, str]:
    """Unit of a state or output, and a few words on it."""
    stem, _, measure = name.rpartition("/")
    if measure in ORDERS and "/" in stem:  # of a sensor
        unit, what = _coordinate(stem, units)
        return {"rate": f"{unit}/s", "gyro": "rad/s"}.get(measure, f"{unit}/s2"), f"{measure} of the {what}"
    kind, _, rest = name.partition("/")
    place, _, last = rest.rpartition("/")
    plain = {
        "state": ("1", f"state {rest}"),  # of a controller
        "strain": ("1", f"strain at {rest}"),
        "pzt": ("V", f"voltage that patch {last} of {place} measures"),
        "modal": ("kg0.5.m", f"modal coordinate {last} of {place}"),
        "point": ("m", f"place of {place} along {last}"),
    }
    if kind in plain:
        return plain[kind]
    if kind == "frame" and place:  # in the plane
        return "rad" if last == "angle" else "m", f"{last} of the frame of {place}"
    if kind == "frame":  # in space
        body, _, number = rest.rpartition(" ")
        return FreeJoint.guess_units[int(number) - 1], f"coordinate {number} of the frame of {body}"
    of = "coordinate of the motor of" if kind == "motor" else "coordinate of joint"
    return units[rest], f"{of} {rest}"


VIBRATION = 1e-6  # imaginary part of a pole over its size, from which it counts as one


def _model_description(unit: Unit) -> bytes:
    """Value references are 0, 1, … of states, derivatives, inputs, outputs."""
    abilities = {
        "modelIdentifier": unit.identifier,
        "canNotUseMemoryManagementFunctions": "true",
        "canGetAndSetFMUstate": "true",
        "providesDirectionalDerivative": "true",
    }
    model, f, u = unit.model, len(unit.states), len(unit.inputs)
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
    references = list(range(2 * f + u + len(unit.outputs)))
    if model.step:
        kinds = {"CoSimulation": abilities}
        del groups["derivatives"], references[f : 2 * f]
    first = sum(len(group) for group in groups.values()) - len(unit.outputs) + 1
    # FMI counts variables from 1; columns of [A B] and [C D] are states, then inputs.
    columns = np.array([*range(1, f + 1), *range(first - u, first)])

    def unknowns(first: int, *blocks: Array) -> dict[int, list[int]]:
        return {first + k: columns[row != 0].tolist() for k, row in enumerate(np.hstack(blocks))}

    outputs = unknowns(first, model.C, model.D)
    rates = {} if model.step else unknowns(f + 1, model.A, model.B)
    structure = {"Outputs": outputs} | ({"Derivatives": rates} if rates else {}) | {"InitialUnknowns": rates | outputs}
    root = new_root(unit.name, unit.guid, unit.description)
    for kind, attributes in kinds.items():
        add(add(add(root, kind, attributes), "SourceFiles"), "File", {"name": SOURCE})
    return finished(root, groups, _experiment(model), references, structure)


def _experiment(model: StateSpace) -> dict[str, str]:
    """Ten periods of the slowest vibration in a thousand steps; a second where there is none, or of samples."""
    if model.step:
        return {"startTime": "0", "stopTime": "1", "stepSize": repr(model.step)}
    poles = np.linalg.eigvals(model.A)
    angular = np.abs(poles.imag)
    vibrations = angular[angular > VIBRATION * np.abs(poles).max()]
    stop = float(f"{10 * 2 * np.pi / vibrations.min():.1g}") if len(vibrations) else 1.0
    return {"startTime": "0", "stopTime": f"{stop:g}", "stepSize": f"{stop / 1000:g}"}


def _numbers(models: Sequence[StateSpace]) -> str:
    """The matrices as C source, those of several models one below the other, and a scale that balances A."""
    _, (scale, _) = matrix_balance(models[0].A, permute=False, separate=True)
    arrays = {key: np.vstack([getattr(of, key) for of in models]) for key in "ABCD"} | {"SCALE": scale[None, :]}
    return "\n".join(_array(name, values) for name, values in arrays.items())


def _header(unit: Unit, models: Sequence[StateSpace]) -> str:
    sizes = {"N_X": unit.states, "N_U": unit.inputs, "N_Y": unit.outputs}
    lines = [f"/* {_comment(unit.name)}: {_comment(unit.description)} */", f'#define GUID "{unit.guid}"']
    lines += [f"#define {name} {len(variables)}" for name, variables in sizes.items()]
    if unit.model.step:
        lines.append(f"#define SAMPLE_TIME {unit.model.step!r} /* s; x(k+1) = A x + B u, y = C x + D u */")
    for title, variables in zip(("States", "Inputs", "Outputs"), sizes.values(), strict=True):
        names = "\n".join(f"     {_comment(each.name)} ({each.unit})" for each in variables)
        lines += ["", f"/* {title}:\n{names} */"]
    if len(models) > 1:
        lines += ["", f"/* Each of A to D {len(models)} times, for TIME (s); straight lines between */"]
        lines += [f"#define N_TIME {len(models)}", _array("TIME", np.array([[of.time for of in models]]))]
    return "\n".join([*lines, "", _numbers(models), ""])


def _comment(text: str) -> str:
    return text.replace("*/", "* /").replace("/*", "/ *")


def _array(name: str, values: Array) -> str:
    rows = ",\n".join("    " + ", ".join(np.format_float_scientific(x, trim="0") for x in row) for row in values)
    return f"static const double {name}[] = {{\n{rows}}};\n"


SOURCE = "linear.c"
COMPILERS = ("cc", "gcc", "clang")


def _binary(unit: Unit, files: Mapping[str, str]) -> dict[str, bytes] | str:
    """The library for this platform by its path in the FMU, compiled by CC, else one of `COMPILERS`; else a reason."""
    try:
        folder, suffix = platform_here()
    except InputError as error:
        return str(error)
    compiler = shlex.split(os.environ.get("CC", "")) or [name for name in COMPILERS if shutil.which(name)][:1]
    if not compiler:
        return f"found no C compiler ({', '.join(COMPILERS)}, or what CC names)"
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
        return {f"binaries/{folder}/{output}": (Path(temporary) / output).read_bytes()}
