"""What joints of trees in 3D carry, by sums over the equations of bodies about the origin: an oracle of the core."""

import numpy as np
import tree_oracle
from body_equations import accelerated, along_cut, body_forces, rotor_moments
from row_wrenches import row_wrenches

from ffrobot.mbs.model.known_motion import Wrench
from ffrobot.mbs.quantities.motion import cut_motions, section_motion


def carried(motion):
    """By joint force and moment (T, 3) on its second side, about where that is, less what acts along the joint."""
    tree, totals, found = motion.model.tree, needed(motion), {}
    frames = tree_oracle.frames(tree, motion.q)
    along = [(row, size, True) for row, size in zip(motion.model.rows, -motion.multipliers.T, strict=True)]
    along += [
        (one.row, one.row.sign * (along_cut(one, motion.time) - one.resistance(of.rate)), False)
        for one, of in cut_motions(motion)
        if one.friction is not None or one.loads
    ]
    for row, size, is_constraint in along:
        if row.kind == "coordinate":  # within a joint
            continue
        sides = row_wrenches(tree, row, size, motion.q, motion.time, frames)
        for section, acting in zip((row.a, row.b), sides, strict=True):
            if section.body >= 0:
                totals[section.body] = totals[section.body].plus(acting, -1.0)
        if is_constraint and not row.is_trajectory:
            second, acting = (row.b, sides[1]) if row.sign > 0 else (row.a, sides[0])
            of_row = acting.seen_from(-tree_oracle.motion(tree, second, motion.q, frames).r)
            found[row.owner] = found[row.owner].plus(of_row) if row.owner in found else of_row
    for number in reversed(range(len(tree.nodes))):
        node, total = tree.nodes[number], totals[number]
        if node.inner.body >= 0:
            totals[node.inner.body] = totals[node.inner.body].plus(total)
        inner, outer = (tree_oracle.motion(tree, section, motion.q, frames) for section in (node.inner, node.outer))
        rest = _workless(node, total.seen_from(-outer.r), inner, outer, motion.q)
        sign, at = (-1.0, outer.r - inner.r) if node.backwards else (1.0, 0.0 * inner.r)
        found[node.joint.name] = Wrench(sign * rest.force, sign * rest.moment).seen_from(at)
    return found


def _workless(node, total, inner, outer, q):
    """Less the motors' directions times the work by v, which follows from velocities of both sections."""
    J = outer.L - inner.L  # at the place of the outer section:
    J[:, :3] -= np.cross(inner.L[:, 3:], (outer.r - inner.r)[:, :, None], axis=1)
    acting = np.hstack([total.force, total.moment])
    work = np.einsum("tik,ti->tk", J[:, :, node.v], acting)
    along = np.einsum("tik,tk->ti", tree_oracle.action(node.joint, q[:, node.q]), work)
    force, moment = (np.einsum("tij,tj->ti", inner.F, part) for part in np.split(along, 2, axis=1))
    return Wrench(total.force - force, total.moment - moment)


def needed(motion):
    """By body what it and the rotors on it need for their motion, less loads; moments about the global origin."""
    tree, state = motion.model.tree, accelerated(motion)
    of_bodies, frames = body_forces(state, motion.model.scene.gravity), tree_oracle.frames(tree, motion.q)
    totals = [Wrench(*of[:2]).seen_from(frame.r) for of, frame in zip(of_bodies, frames, strict=True)]
    for load in motion.model.scene.load:
        if load.point is not None:
            body, acting = tree.index[load.point.partition(".")[0]], of_load(motion, load)
            totals[body] = totals[body].plus(acting, -1.0)
    for node in tree.nodes:
        first = (node.outer if node.backwards else node.inner).body
        if first >= 0:
            moment = rotor_moments(state, node)
            totals[first] = totals[first].plus(Wrench(np.zeros_like(moment), moment))
    return totals


def of_load(motion, load):
    """A given load at a point, moments about the global origin."""
    values = {name: function.sample(motion.time)[0] for name, function in load.components.items()}
    none = np.zeros(len(motion.time))
    force, moment = (np.stack([values.get(key, none) for key in keys], axis=1) for keys in ("xyz", ("mx", "my", "mz")))
    return Wrench(force, moment).seen_from(section_motion(motion, load.point).r)
