"""`ffrobot export SCENE.toml --format fmu`: a forward motion as an FMU for co-simulation."""

import logging
from collections.abc import Iterator, Mapping
from pathlib import Path

import numpy as np

from ...actuation.patches.link_patches import LinkPatches
from ...common.arrays import Array
from ...common.errors import InputError, check_known, naming, quoted
from ...common.structs import struct
from ...fe_models.modal_body import ModalBody
from ...mbs import _core
from ...mbs.analysis.forward import Forward
from ...mbs.linear.statics import hanging_joints, initial_state
from ...mbs.model.gears import with_compliance
from ...mbs.model.known_motion import State
from ...mbs.model.model import Model
from ...mbs.model.nodes import Node
from ...mbs.model.system import MultibodySystem
from ...mbs.posture.start import undeformed_posture
from ...mbs.run.integrators import METHODS, integrator_of
from ...run.mode_search import mode_levels
from ...run.prepare import prepare_scene, with_bodies
from ...run.prepared import Prepared
from ...run.watcher import Watcher
from ...scene.load import load_scene
from ...scene.scene import Scene
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

logger = logging.getLogger(__name__)

LIBRARY = "ffrobot_fmu.so"  # beside the core (CMakeLists.txt)


def forward_fmu(path: Path, analysis: str | None) -> tuple[bytes, str, tuple[str, ...], str]:
    """Return the FMU of a forward analysis (default: the first), a summary, remarks, and the analysis' name.

    Raises `InputError` for scenes and machines for which there are no such FMUs.
    """
    scene = load_scene(path)
    with naming(path):
        chosen = _chosen(scene, analysis)
        _check(scene)
        folder, suffix = platform_here()
    prepared = prepare_scene(scene, _Logged())
    bodies = mode_levels(scene, prepared.bodies)[-1]  # "auto": all of them
    model = with_compliance(with_bodies(prepared, bodies).model.without_paths())
    unit = _forward_unit(model, prepared, chosen, AXES[:2] if scene.is_planar else AXES)
    unit.data.guid = guid_of(unit.data.to_bytes().hex(), (*unit.inputs, *unit.outputs))
    identifier = identifier_of(scene.name, chosen.name)
    content = {
        "modelDescription.xml": _model_description(unit, identifier, f"{scene.name}, {chosen.name}", chosen),
        "resources/model.bin": unit.data.to_bytes(),  # mbs/fmu/forward.cpp
        f"binaries/{folder}/{identifier}{suffix}": Path(str(_core.__file__)).with_name(LIBRARY).read_bytes(),
    }
    what = f"{chosen.name}, {len(unit.inputs)} inputs, {len(unit.outputs)} outputs"
    return zipped(content), what, tuple(_remarks(scene, model, unit, folder)), chosen.name


class _Logged(Watcher):
    def stage(self, title: str) -> None:
        logger.info("%s", title)


def _chosen(scene: Scene, name: str | None) -> Forward:
    analyses = {each.name: each for each in scene.analysis}
    if name is not None:
        check_known(name, analyses, f"--analysis: expected one of {quoted(analyses)}")
    fitting = (each for each in scene.analysis if isinstance(each, Forward) and each.actuation is None)
    if (chosen := next((each for each in fitting if name in (None, each.name)), None)) is not None:
        return chosen
    wanted = 'an analysis of kind "forward" without actuation, whose motors are the inputs of the FMU'
    if name is None:
        raise InputError(f"--analysis: expected {wanted}", "none")
    what = f'kind "{analyses[name].kind}"' + (" with actuation" if isinstance(analyses[name], Forward) else "")
    raise InputError(f"--analysis: expected {wanted}", f'"{name}" of {what}')


def _check(scene: Scene) -> None:
    of = "of a scene for an FMU"
    if scene.load:
        raise InputError(f"load: expected none {of}, whose loads are its inputs", "some")
    for body in scene.body:
        if body.pieces is not None:
            raise InputError(f'body "{body.name}": pieces: expected none {of}', body.pieces)
    if scene.geometric_stiffening == "auto":
        auto = '"auto", by which the motion of an analysis decides'
        raise InputError(f"geometric_stiffening: expected true or false {of}", auto)
    if scene.motors == "frame":
        raise InputError(f'motors: expected "section" {of}', '"frame"')


COMPONENTS = ("xx", "yy", "zz", "yz", "xz", "xy")  # the last three are 2 ε, as in modal body files
AXES = "xyz"

Input = tuple[Variable, Array]
"""A variable, and its generalized force (n_v,) per unit."""
Linear = tuple[Variable, _core.LinearOutput]


@struct
class ForwardUnit:
    """Variables of an FMU of a forward motion, and the model `data` for its library.

    `references`: value references of inputs and outputs, which are their numbers in the library.
    """

    inputs: tuple[Variable, ...]
    outputs: tuple[Variable, ...]
    references: tuple[int, ...]
    data: _core.ForwardModel


def _forward_unit(model: Model, prepared: Prepared, analysis: Forward, axes: str) -> ForwardUnit:
    """The motion from the initial state under moments of motors and voltages; points are outputs along `axes`."""
    data, start = MultibodySystem(model).forward_model(), initial_state(model, undeformed_posture(model))
    data.q, data.v = start.q, start.v
    data.method = METHODS[integrator_of(model, analysis.integrator)]
    data.spectral_radius, data.tolerance = analysis.spectral_radius, analysis.tolerance
    data.duration = analysis.last_time
    inputs = [*_motors(model), *_voltages(model, prepared.patches)]
    linear = [*_joints(model), *_modes_and_strains(model, prepared.links)]
    places = list(_places(model))
    data.inputs = [direction for _, direction in inputs]
    data.linear, data.places = [output for _, output in linear], [output for _, output in places]
    outputs = [(variable, True) for variable, _ in linear]
    outputs += [
        (Variable(f"point/{point}/{axis}", "m", f"place of {point} along {axis}"), axis in axes)
        for point, _ in places
        for axis in AXES
    ]
    references = [*range(len(inputs)), *(k for k, (_, is_one) in enumerate(outputs, len(inputs)) if is_one)]
    chosen = tuple(variable for variable, is_one in outputs if is_one)
    return ForwardUnit(tuple(each for each, _ in inputs), chosen, tuple(references), data)


def _motors(model: Model) -> Iterator[Input]:
    """Inputs of motors; those before compliant gears act there."""
    units = {joint.name: joint.units for joint in model.scene.joint}
    for joint, columns in model.motors.items():
        for k, (column, unit) in enumerate(zip(columns, units[joint], strict=True), 1):
            variable = motor(numbered(joint, k, len(columns)), unit)
            yield variable, model.sign(joint) * np.eye(model.tree.n_v)[column]


def _voltages(model: Model, patches: Mapping[str, LinkPatches]) -> Iterator[Input]:
    for of_link in patches.values():
        directions = model.modal_directions(of_link.per_volt)
        for layout, array in of_link.arrays.items():
            rows = directions[of_link.columns(layout)] if array.layout.is_driven else ()
            yield from ((voltage(layout, k), row) for k, row in enumerate(rows, 1))


def _joints(model: Model) -> Iterator[Linear]:
    """Coordinates and rates of joints that the state has as they are, and of motors before compliant gears."""
    tree = model.tree
    for joint in model.scene.joint:
        node = tree.nodes[tree.carried[joint.name]] if joint.name in tree.carried else None
        if node is None or not _has_own_coordinates(node):
            continue
        columns = model.columns(joint.name)
        for k, (column, unit) in enumerate(zip(columns, joint.units, strict=True), 1):
            name, entry = numbered(joint.name, k, len(columns)), node.q.start + int(column) - node.v.start
            entries = (entry, tree.n_q + int(column))
            yield from _with_rate(f"joint/{name}", f"joint {name}", unit, entries, node.sign)
    for gear in tree.gears:
        name, entries = gear.joint.joint.name, (gear.motor.q.start, tree.n_q + gear.motor.v.start)
        yield from _with_rate(f"motor/{name}", f"the motor of {name}", "rad", entries, 1.0)


def _with_rate(name: str, of: str, unit: str, entries: tuple[int, int], sign: float) -> Iterator[Linear]:
    yield Variable(name, unit, f"coordinate of {of}"), _core.LinearOutput([entries[0]], [sign])
    yield Variable(f"{name}/rate", f"{unit}/s", f"rate of {of}"), _core.LinearOutput([entries[1]], [sign])


def _has_own_coordinates(node: Node) -> bool:
    """Whether the joint's coordinates are entries of q, but for a sign."""
    joint = node.joint
    return bool(joint.units) and joint.q_count == joint.freedoms and not (joint.type == "planar" and node.backwards)


def _modes_and_strains(model: Model, links: Mapping[str, ModalBody]) -> Iterator[Linear]:
    """Modal coordinates in each body's file, and strains at its points, link axes; of 2D scenes in the plane."""
    for node in model.tree.nodes:
        name, T = node.body.name, node.body.modal_transform
        rows = [
            (Variable(f"modal/{name}/{k}", "kg0.5.m", f"modal coordinate {k} of {name}"), row)
            for k, row in enumerate(T, 1)
        ]
        for label, point in links[name].stress.items() if name in links else ():
            for component, row in zip(COMPONENTS, point.strain @ T, strict=True):
                about = f"strain {component} at {label} of {name}"
                rows.append((Variable(f"strain/{name}.{label}/{component}", "1", about), row))
        entries = list(range(node.p_q.start, node.p_q.stop))
        yield from ((variable, _core.LinearOutput(entries, row.tolist())) for variable, row in rows if np.any(row))


def _places(model: Model) -> Iterator[tuple[str, _core.PlaceOutput]]:
    for number, node in enumerate(model.tree.nodes):
        for label, at in node.body.points.items():
            K = [] if node.body.stiffening is None else list(node.body.stiffening.at(label)[:3])
            yield f"{node.body.name}.{label}", _core.PlaceOutput(number, at.position, at.translation, K)


def _model_description(unit: ForwardUnit, identifier: str, name: str, analysis: Forward) -> bytes:
    about = "motion from the initial state under piecewise constant inputs; gravity and friction act as in the scene"
    root = new_root(name, unit.data.guid, about)
    add(
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
    return finished(root, groups, experiment, unit.references, {"Outputs": unknowns, "InitialUnknowns": unknowns})


def _remarks(scene: Scene, model: Model, unit: ForwardUnit, folder: str) -> Iterator[str]:
    yield f"inputs are constant over a communication step; binary for {folder} alone, without sources"
    if not unit.inputs:
        yield "there are no inputs: no joint has a motor, no link patches"
    # Those at which loops are cut, and those that are turned freely.
    silent = [node.joint for node in model.tree.nodes if not _has_own_coordinates(node)] + list(model.tree.loops)
    if names := [joint.name for joint in silent if joint.units]:
        yield f"{quoted(names)}: no outputs of their coordinates, as they are none of the state"
    yield from hanging_joints(model, undeformed_posture(model), State(unit.data.q, unit.data.v))
    if any(layout.amplifier or layout.hysteresis for layout in scene.pzt):
        yield "voltages are those on the patches: amplifiers and hysteresis do not act"
    yield "limits of motors and patches do not act"
