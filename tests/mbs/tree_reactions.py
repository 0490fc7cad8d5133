"""What joints of trees in 3D carry, by sums over the equations of bodies about the origin: an oracle of the core."""

import numpy as np
from body_equations import accelerated, along_cut, body_forces, rotors
from row_wrenches import row_wrenches

from ffrobot.mbs.model.spatial_wrench import Wrench


def carried(motion):
    """By joint force and moment (T, 3) on its second side, about where that is, with all that acts along it."""
    tree, totals, found = motion.model.tree, needed(motion), {}
    along = [(row, size) for row, size in zip(motion.model.rows, -motion.multipliers.T, strict=True)]
    along += [
        (one.row, one.row.sign * (along_cut(one, motion.time) - one.resistance(of.rate)))
        for one, of in motion.cut
        if one.is_loaded
    ]
    for row, size in along:
        if row.kind == "coordinate":  # within a joint
            continue
        sides = row_wrenches(tree, row, size, motion.q, motion.time, motion.frames)
        for section, acting in zip((row.a, row.b), sides, strict=True):
            if section.body >= 0:
                totals[section.body] = totals[section.body].plus(acting, -1.0)
        if not row.is_trajectory:
            second, acting = (row.b, sides[1]) if row.sign > 0 else (row.a, sides[0])
            of_row = acting.seen_from(-tree.motion(second, motion.q, motion.frames).r)
            found[row.owner] = found[row.owner].plus(of_row) if row.owner in found else of_row
    for number in reversed(range(len(tree.nodes))):
        node, total = tree.nodes[number], totals[number]
        if node.inner.body >= 0:
            totals[node.inner.body] = totals[node.inner.body].plus(total)
        at = tree.motion(node.inner if node.backwards else node.outer, motion.q, motion.frames).r
        sign = -1.0 if node.backwards else 1.0
        found[node.joint.name] = Wrench(sign * total.force, sign * total.moment).seen_from(-at)
    return found


def needed(motion):
    """By body what it and the rotors on it need for their motion, less loads; moments about the global origin."""
    tree, state, gravity, totals = motion.model.tree, accelerated(motion), np.array(motion.model.scene.gravity), []
    for node, of_frame, frame in zip(tree.nodes, state.of_frames(), motion.frames, strict=True):
        of_body = body_forces(node, state, of_frame, gravity)
        totals.append(Wrench(of_body.force, of_body.moment).seen_from(frame.r))
    for load in motion.model.scene.load:
        if load.point is not None:
            body, acting = tree.index[load.point.partition(".")[0]], of_load(motion, load)
            totals[body] = totals[body].plus(acting, -1.0)
    for rotor in rotors(state):
        if rotor.first.body >= 0:
            moment = rotor.torque[:, None] * rotor.axis + rotor.gyroscopic
            totals[rotor.first.body] = totals[rotor.first.body].plus(Wrench(np.zeros_like(moment), moment))
    return totals


def of_load(motion, load):
    """A given load at a point, moments about the global origin."""
    values = {name: function.sample(motion.time)[0] for name, function in load.components.items()}
    none = np.zeros(len(motion.time))
    force, moment = (np.stack([values.get(key, none) for key in keys], axis=1) for keys in ("xyz", ("mx", "my", "mz")))
    return Wrench(force, moment).seen_from(motion.section(load.point).r)
