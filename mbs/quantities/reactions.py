"""Forces in the joints of a tree, by the core's Newton–Euler algorithm. Global axes.

How joints share loads where constraints of loops are redundant: what that leaves open, and a split.

Constraints of loops depend on each other where rigid links constrain a motion twice, as parallel axes do. With C_v by
joints and modes, multipliers λ0 with C_vᵀ λ0 = 0 change reactions without changing the motion.
"""

from collections.abc import Mapping
from dataclasses import replace

import numpy as np

from ...common.arrays import Array, Integers
from ...common.structs import struct
from ..model.known_motion import MotionForces, Wrench, multiplier_forces
from ..posture.posture import SINGULAR
from ..run.record import Run
from ..scene.loads import OF_POINT
from .motion import acting_forces, constraint_rows, places, system_of
from .supply import behind_gears


def reactions(run: Run) -> Mapping[str, Wrench]:
    """Reactions (T, 3) by joint: force on its second side, N, and moment about that side, N·m, global axes.

    A joint of the tree carries the rate of momentum of its outboard subtree less other forces there, and less those
    along its coordinates (motors, friction, loads, rotors). One that closes a loop has those of its multipliers.
    """
    behind = behind_gears(run)
    return _carried(run, acting_forces(behind), behind.q)


def _carried(run: Run, forces: MotionForces, q: Array) -> dict[str, Wrench]:
    """By joint what it carries but does no work along it; q (T, n) are those of the tree of `forces`."""
    model, nothing = run.model, np.zeros((len(q), 3))
    loops = [joint.name for joint in model.tree.loops]
    wrenches = dict.fromkeys(loops, Wrench(nothing, nothing))  # that of a free joint
    for number, row in enumerate(model.rows):
        if not row.is_trajectory and row.coordinate < 0:  # else it turns a rotor, along the joint
            wrenches[row.owner] = wrenches[row.owner].plus(forces.of_row(number))
    for node, carried in zip(model.tree.nodes, forces.carried(q), strict=False):
        if node.joint.name in loops:
            continue
        if node.backwards:  # the second side is the inner one
            outer, inner = (places(run).at(section).r for section in (node.outer, node.inner))
            carried = Wrench(-carried.force, -carried.moment).seen_from(outer - inner)
        wrenches[node.joint.name] = carried
    return wrenches


OPEN = 1e-6  # share of a component in reactions that change together, above which it is open
SAMPLES = 5  # outputs that are looked at: constraints that depend on each other in all of them do so everywhere


@struct
class Sharing:
    """Reactions that redundant loop constraints leave undetermined."""

    redundant: int  # number of constraint equations that depend on others
    # by joint the undetermined components x, y, z, mx, my, mz of its reaction, global axes
    components: Mapping[str, tuple[str, ...]]

    @property
    def in_words(self) -> str:
        """A warning that names the joints and components."""
        of_joints = "; ".join(f'"{joint}" ({", ".join(of)})' for joint, of in self.components.items())
        return (
            f"{self.redundant} constraints of kinematic loops are redundant: nothing determines how these reactions"
            f" are shared: {of_joints}; the results are the least-squares solution. Use flexible links, or joints with"
            " more degrees of freedom in loops"
        )


def shared_evenly(run: Run) -> tuple[Run, Sharing | None]:
    """Make redundant loop reactions unique by their least sum of squares; moments are divided by the robot's size.

    Return the run with these multipliers, and the reactions that stay undetermined; None where there are none.
    """
    is_loop = run.model.loop_rows
    if not is_loop.any() or not len(run.time):
        return run, None
    B, measured = _multipliers_of_loops(run)
    row_scales = run.model.row_sizes[measured]
    J = np.einsum("rm,tri->tmi", B, constraint_rows(run)[1][:, is_loop]) * run.model.natural_sizes / row_scales[:, None]
    some = np.unique(np.linspace(0, len(J) - 1, SAMPLES).astype(int))
    values = np.linalg.svd(J[some], compute_uv=False)
    redundant = J.shape[1] - int(np.max(np.sum(values > SINGULAR * np.maximum(values[:, :1], 1.0), axis=1)))
    if redundant == 0:
        return run, None
    null = B @ (np.linalg.eigh(J @ J.swapaxes(1, 2))[1][:, :, :redundant] / row_scales[:, None])  # ascending
    changes = []
    for column in null.transpose(2, 0, 1):
        alone = np.zeros_like(run.multipliers)
        alone[:, is_loop] = -column
        forces = multiplier_forces(system_of(run), run.q, run.time, alone)
        changes.append(_side_by_side(run, _carried(run, forces, run.q)))
    basis = np.stack(changes, axis=-1)  # (T, components, redundant)
    even = -np.einsum("tkc,tc->tk", np.linalg.pinv(basis), _side_by_side(run, reactions(run)))
    multipliers = run.multipliers.copy()
    multipliers[:, is_loop] -= np.einsum("trk,tk->tr", null, even)
    components = _open(run, basis)
    return replace(run, multipliers=multipliers), Sharing(redundant, components) if components else None


def _multipliers_of_loops(run: Run) -> tuple[Array, Integers]:
    """B (rows that close loops, m): multipliers of these rows by those that do something; m rows with their measures.

    In planar scenes only those in the plane do.
    """
    is_loop = run.model.loop_rows
    plane = system_of(run).plane if run.space.is_plane else None
    if plane is None:
        return np.eye(int(is_loop.sum())), np.flatnonzero(is_loop)
    of_loops = is_loop[plane.followed]
    B = run.model.row_signs[:, None] * plane.spread
    return B[np.ix_(is_loop, of_loops)], plane.followed[of_loops]


def _side_by_side(run: Run, wrenches: Mapping[str, Wrench]) -> Array:
    """(T, 6 joints) force and moment of the scene's joints, N, moments over the size of the robot."""
    length = run.model.size
    parts = (wrenches[joint.name] for joint in run.model.scene.joint)
    return np.hstack([values for acting in parts for values in (acting.force, acting.moment / length)])


def _open(run: Run, basis: Array) -> dict[str, tuple[str, ...]]:
    """Components that the space has of joints which any combination of changes (T, 6 joints, redundant) moves."""
    directions = np.linalg.svd(basis, full_matrices=False)[0]
    joints = [joint.name for joint in run.model.scene.joint]
    moved = np.linalg.norm(directions, axis=2).max(axis=0).reshape(len(joints), len(OF_POINT)) > OPEN
    space = run.space
    moved[:, [axis not in (*space.translations, *(3 + k for k in space.rotations)) for axis in range(6)]] = False
    free = {name: tuple(np.array(OF_POINT)[of].tolist()) for name, of in zip(joints, moved, strict=True)}
    return {name: components for name, components in free.items() if components}
