"""What analyses have to know of whole links where the equations are those of their pieces."""

from __future__ import annotations

from dataclasses import replace
from functools import partial

import numpy as np

from ..common.arrays import Array
from ..common.errors import InputError
from ..mbs.model.divided_link import DividedLink, PieceOfLink, divided_link_of
from ..mbs.model.model import Model
from ..mbs.model.nodes import Node
from ..mbs.run.context import WholeLinks
from ..mbs.run.outcome import Outcome
from ..scene.pieces import places_on_pieces
from .pieces import MotionOfLinks, divided_links
from .solution import Solution

STEP = 1e-3  # of the links' longest 1/ω, along a motion: of central differences of modal velocities


def make_whole_links(solution: Solution) -> WholeLinks | None:
    """The links of a solution in which some are in pieces; None where none is."""
    if solution.whole is None:
        return None
    divided = {name: _divided(solution, name) for name in solution.divided}
    return WholeLinks(solution.whole, divided, places_on_pieces(solution.divided), partial(_as_links, solution))


def _divided(solution: Solution, name: str) -> DividedLink:
    link, body = solution.bodies[name], solution.divided[name]
    pieces = []
    for piece, start in zip(body.names, body.cut.starts, strict=True):
        modal = solution.parts[piece].modal
        assert modal is not None
        pieces.append(PieceOfLink(start, modal, solution.parts[piece].spatial))
    assert link.modal is not None
    return divided_link_of(link.modal, link.spatial, pieces)


def _as_links(solution: Solution, run: Outcome) -> Outcome:
    """A run of the pieces in the coordinates of the robot with whole links: those of joints, and the nearest shapes.

    Its multipliers and what drives it stay behind. Raises `InputError` for joints that have no coordinates there.
    """
    whole = solution.whole
    assert whole is not None
    q = np.zeros((len(run.time), whole.tree.n_q))
    v, a = np.zeros((2, len(run.time), whole.tree.n_v))
    step = STEP / np.sqrt(min(float(node.body.stiffness.min()) for node in whole.tree.nodes if node.body.n_modes))
    now, *beside = (_modal(solution, run, dt) for dt in (0.0, -step, step))
    for node in whole.tree.nodes:
        if node.joint.freedoms:
            _take_joint(whole, node, run, (q, v, a))
        name, to_own = node.body.name, np.linalg.pinv(node.body.modal_transform).T
        if node.body.n_modes:
            q[:, node.p_q], v[:, node.p_v] = (values @ to_own for values in now[name])
            behind, ahead = (of[name][1] for of in beside)
            a[:, node.p_v] = (ahead - behind) @ to_own / (2 * step)
    motion = replace(run.motion, q=q, v=v, a=a, multipliers=np.zeros((len(run.time), len(whole.rows))))
    return replace(run, model=whole, motion=motion, forces=replace(run.forces, required=None), prescribed=None)


def _modal(solution: Solution, run: Outcome, step: float) -> dict[str, tuple[Array, Array]]:
    """By body, modal coordinates and velocities (T, n) in the modes of its file, `step` (s) later."""
    tree, divided = run.model.tree, divided_links(solution)
    q, v = tree.integrate(run.q, step * run.v), run.v + step * run.a
    motion = MotionOfLinks(run.model, run.time, q, v, run.a, run.multipliers, divided=divided)
    found = {name: motion.body(name) for name in motion.points}
    return {name: (body.modal, body.modal_velocity) for name, body in found.items()}


def _take_joint(whole: Model, node: Node, run: Outcome, states: tuple[Array, Array, Array]) -> None:
    """Coordinates, rates and accelerations of the joint of `node`, from the tree of the pieces to that of the links."""
    tree = run.model.tree
    number = tree.carried.get(node.joint.name)
    same = number is not None and tree.nodes[number].backwards == node.backwards
    if number is None or not (same or len(node.joint.units) == 1):
        raise InputError(
            f"{whole.scene.path}: {node.joint.label}: expected joints that have the same place in the tree with"
            " subdivided links as with whole ones if these are controlled, found another. List it before the others"
            " of its loop"
        )
    sign, other = 1.0 if same else -1.0, tree.nodes[number]
    for to, values, slices in zip(states, (run.q, run.v, run.a), ("q", "v", "v"), strict=True):
        to[:, getattr(node, slices)] = sign * values[:, getattr(other, slices)]
