"""`ffrobot export SCENE.toml --format fmu`: a forward motion as an FMU for co-simulation."""

from __future__ import annotations

import logging
import platform
import sys
from pathlib import Path

from ...common.errors import InputError, check_known, quoted
from ...common.version import VERSION
from ...mbs import _core
from ...mbs.analysis.forward import Forward
from ...mbs.linear.statics import hanging_joints
from ...mbs.model.gears import with_compliance
from ...mbs.model.known_motion import State
from ...mbs.model.model import Model
from ...mbs.posture.start import undeformed_posture
from ...run.mode_search import mode_levels
from ...run.prepare import prepare_scene, with_bodies
from ...run.watcher import Watcher
from ...scene.load import load_scene
from ...scene.scene import Scene
from .description import PLATFORMS, forward_description, guid_of, identifier_of, zipped
from .forward_model import AXES, ForwardUnit, forward_unit, has_own_coordinates, voltages_of_patches

logger = logging.getLogger(__name__)

LIBRARY = "ffrobot_fmu.so"  # beside the core (CMakeLists.txt)
RESOURCE = "resources/model.bin"  # mbs/fmu/forward.cpp


def forward_fmu(path: Path, analysis: str | None) -> tuple[bytes, str, tuple[str, ...], str]:
    """The FMU of an analysis of kind "forward", the first if not named; a few words on it, remarks, its name.

    Raises:
        InputError: there is no such analysis, or something acts that the FMU does not have.
        SolveError: the scene has no state to start from.
    """
    scene = load_scene(path)
    chosen = _chosen(path, scene, analysis)
    _check(path, scene)
    place = PLATFORMS.get((sys.platform, platform.machine()))
    if place is None:
        raise InputError(f"{path}: --format fmu: FMI 2.0 has no name for {sys.platform} on {platform.machine()}")
    model, unit = _unit(scene, chosen)
    unit.data.guid = guid_of(unit.data.to_bytes().hex(), (*unit.inputs, *unit.outputs))
    identifier, (folder, suffix) = identifier_of(scene.name, chosen.name), place
    library = Path(str(_core.__file__)).with_name(LIBRARY)
    content = {
        "modelDescription.xml": forward_description(
            unit, identifier, f"{scene.name}, {chosen.name}", chosen, f"ffrobot {VERSION}"
        ),
        RESOURCE: unit.data.to_bytes(),
        f"binaries/{folder}/{identifier}{suffix}": library.read_bytes(),
    }
    what = f"{chosen.name}, {len(unit.inputs)} inputs, {len(unit.outputs)} outputs"
    return zipped(content), what, tuple(_remarks(scene, model, unit, folder)), chosen.name


class _Logged(Watcher):
    def stage(self, title: str) -> None:
        logger.info("%s", title)


def _unit(scene: Scene, analysis: Forward) -> tuple[Model, ForwardUnit]:
    prepared = prepare_scene(scene, _Logged())
    bodies = mode_levels(scene, prepared.bodies)[-1]  # "auto": all of them
    model = with_compliance((with_bodies(prepared, bodies).model).without_paths())
    voltages = voltages_of_patches(model, prepared.patches)
    return model, forward_unit(model, voltages, prepared.links, analysis, AXES[:2] if scene.is_planar else AXES)


def _chosen(path: Path, scene: Scene, name: str | None) -> Forward:
    analyses = {each.name: each for each in scene.analysis}
    if name is not None:
        check_known(name, analyses, f"{path}: --analysis: expected one of {quoted(analyses)}")
    fitting = (each for each in scene.analysis if isinstance(each, Forward) and each.actuation is None)
    if (chosen := next((each for each in fitting if name in (None, each.name)), None)) is not None:
        return chosen
    wanted = 'an analysis of kind "forward" without actuation, whose motors are the inputs of the FMU'
    if name is None:
        raise InputError(f"{path}: --analysis: expected {wanted}", "none")
    kind = getattr(analyses[name], "kind", "?")
    what = f'kind "{kind}"' + (" with actuation" if isinstance(analyses[name], Forward) else "")
    raise InputError(f"{path}: --analysis: expected {wanted}", f'"{name}" of {what}')


def _check(path: Path, scene: Scene) -> None:
    if scene.load:
        raise InputError(f"{path}: load: expected none of a scene for an FMU, whose loads are its inputs", "some")
    for body in scene.body:
        if body.pieces is not None:
            raise InputError(f'{path}: body "{body.name}": pieces: expected none of a scene for an FMU', body.pieces)
    if scene.geometric_stiffening == "auto":
        raise InputError(
            f"{path}: geometric_stiffening: expected true or false of a scene for an FMU",
            '"auto", by which the motion of an analysis decides',
        )
    if scene.motors == "frame":
        raise InputError(f'{path}: motors: expected "section" of a scene for an FMU', '"frame"')


def _remarks(scene: Scene, model: Model, unit: ForwardUnit, folder: str) -> list[str]:
    remarks = [f"inputs are constant over a communication step; binary for {folder} alone, without sources"]
    if not unit.inputs:
        remarks.append("there are no inputs: no joint has a motor, no link patches")
    # Those at which loops are cut, and those that are turned freely.
    silent = [node.joint for node in model.tree.nodes if not has_own_coordinates(node)] + list(model.tree.loops)
    if names := [joint.name for joint in silent if joint.units]:
        remarks.append(f"{quoted(names)}: no outputs of their coordinates, as they are none of the state")
    remarks += hanging_joints(model, undeformed_posture(model), State(unit.data.q, unit.data.v))
    if any(layout.amplifier or layout.hysteresis for layout in scene.pzt):
        remarks.append("voltages are those on the patches: amplifiers and hysteresis do not act")
    return [*remarks, "limits of motors and patches do not act"]
