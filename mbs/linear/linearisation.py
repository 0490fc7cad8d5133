"""The equations of motion, linear about a posture or a motion, in independent coordinates.

docs/theory.md, Linear models; the core differentiates them exactly (core/recursion/inverse/force_slopes.h). Increments
δ of the tree's coordinates have δ̇ = δv + B δ, and loops leave δ = H δs and δv = H δv_s + N δs, where v_s are the rates
of the independent coordinates s. So Ḣ = N − H B_s H.

Forces along s that drive the motion are constant; in their place, moments of motors that turn frames.
"""

from collections.abc import Iterator, Mapping, Sequence

import numpy as np

from ...common.arrays import Array, Indices
from ...common.errors import InputError, SolveError
from ...common.libraries import scipy
from ...common.rotations import skew
from ...common.structs import struct
from ..joints.joint import coordinate_names
from ..model.gears import gear_matrices
from ..model.known_motion import KnownStates, required_forces
from ..model.model import Model
from ..model.nodes import Node
from ..model.system import FrameShare, MultibodySystem, frame_share, turning_motors
from ..scene.space import SPACES

DEPENDENT = 1e-8  # of a row's gradient, what others must leave of it to count as independent


@struct
class LinearMechanism:
    """M δs̈ + D δṡ + K δs = inputs · δu about (time, q, v, a); f independent coordinates s. SI units."""

    time: float
    q: Array
    v: Array
    a: Array
    # M, D, K: (f, f)
    M: Array
    D: Array
    K: Array
    # (f,) per unit of each motor ("joint/NAME") and force at a point ("force/BODY.POINT/x", "…/y")
    inputs: Mapping[str, Array]
    # (f,) derivatives of joint coordinates ("joint/NAME"), of motors behind compliant gears ("motor/NAME"), and places
    # of points ("point/BODY.POINT/x", …)
    outputs: Mapping[str, Array]
    # (k, f) by "BODY.POINT": translations along the axes of the space, then rotations about them
    points: Mapping[str, Array]
    # (k, k) by those points that have axes of their own: their components from those of the space
    tool_axes: Mapping[str, Array]
    transformation: Array  # H = ∂q/∂s (coordinates, f)
    transformation_rate: Array  # its rate along the motion: δv = H δṡ + H_dot δs
    force: Array  # (f,) forces along s that drive the motion itself, modal forces beside the loads
    names: tuple[str, ...]  # (f,) of s: "joint/NAME" (or what was chosen instead), then "modal/BODY/k", k from 1

    def of_tool(self, point: str) -> Array:
        """Jacobian (k, f) of "BODY.POINT" by s, m and rad, as in `points`, but in its own axes, if any."""
        J = self.points[point]
        return self.tool_axes[point] @ J if point in self.tool_axes else J


class LinearEquations:
    """Equations of motion, SI units, that `at` makes linear in independent coordinates s about any posture.

    `model` has no trajectories; its gears are compliant where its tree says so. Independent are motors' coordinates
    where loops leave them so, then other joint coordinates, and modes, those first that the loops determine worst at
    `q` (n_q,) (QR with pivoting). At `points`, "BODY.POINT" of the scene, forces are inputs and places outputs; a
    mapping names the model's point for each (of links in pieces).
    """

    def __init__(self, model: Model, q: Array, points: Sequence[str] | Mapping[str, str] = ()) -> None:
        for node in model.tree.nodes:
            if node.backwards and node.joint.type == "planar":  # its coordinates are not linear in the tree's
                raise InputError(
                    f"{model.scene.path}: {node.joint.label}: between: expected the side nearer to the ground first for"
                    " linear models",
                    "it second",
                )
        self.points = dict(points) if isinstance(points, Mapping) else {point: point for point in points}
        self.model, self.system = model, MultibodySystem(model)
        self._on_frames = turning_motors(model)
        self.independent = _independent(model, q)
        names, signs = _coordinates(model)
        self.names = tuple(names[k] for k in self.independent)
        self._signs = signs[self.independent]

    def at(self, t: float, q: Array, v: Array, a: Array) -> LinearMechanism:
        """The linear equations about a motion at time t, s, whose q (n_q,), v and a (n_v,), SI, keep the loops closed.

        Raises `SolveError` in a posture in which the independent coordinates do not determine the others.
        """
        tree, s = self.model.tree, self.independent
        state = KnownStates(q[None], v[None], a[None])
        H, determine = self._followers(state, t)
        force = H.T @ required_forces(self.system, state, np.array([t]))[0]
        along_s = np.zeros(tree.n_v)
        along_s[s] = force
        core, N = self.system.core.derivatives(self.system.scene, t, q, v, along_s), np.zeros_like(H)
        N[np.setdiff1d(np.arange(tree.n_v), s)] = -determine @ (self.model.row_signs[:, None] * core.rate_q) @ H
        B, B_dot = _bracket(tree.nodes, v), _bracket(tree.nodes, a)[s]
        H_dot = N - H @ B[s] @ H
        by_rate = core.a_v[s] @ H + B[s] @ H
        by_s = core.a_q[s] @ H + core.a_v[s] @ H_dot + B_dot @ H + B[s] @ (H_dot + B @ H)
        M = np.linalg.inv(core.a_f[np.ix_(s, s)])
        sides = self._signs[:, None] * self._signs
        H, H_dot = H * self._signs, H_dot * self._signs
        shares = {joint: frame_share(self.model, joint, q) for joint in self._on_frames}
        moments = {joint: along_s[self.model.motors[joint][0]] for joint in shares}
        points, tool_axes = self._points(state, H)
        on_modes = sum((moments[joint] * shares[joint].direction for joint in shares), np.zeros(tree.n_v))
        # Not by way of M⁻¹, whose round-off is that of the stiffest modes
        K_more, D_more = gear_matrices(tree, q)
        K_more -= sum((moments[joint] * shares[joint].slope for joint in shares), np.zeros_like(K_more))
        return LinearMechanism(
            t,
            q,
            v,
            a,
            M=sides * (M + M.T) / 2,
            D=H.T @ D_more @ H - sides * (M @ by_rate),
            K=H.T @ (K_more @ H + D_more @ H_dot) - sides * (M @ by_s),
            inputs=self._inputs(H, shares, points),
            outputs=self._outputs(state, H, points),
            points=points,
            tool_axes=tool_axes,
            transformation=H,
            transformation_rate=H_dot,
            force=self._signs * force - on_modes @ H,
            names=self.names,
        )

    def _followers(self, state: KnownStates, t: float) -> tuple[Array, Array]:
        """H (n_v, f), and what gives the coordinates that follow from the rates that rows would get (n_v − f, rows)."""
        n_v, s = self.model.tree.n_v, self.independent
        H = np.zeros((n_v, len(s)))
        H[s, np.arange(len(s))] = 1.0
        others = np.setdiff1d(np.arange(n_v), s)
        rows, sizes = self.model.row_sizes, self.model.natural_sizes
        (C_v,) = self.model.constraints.natural_gradients(state.q, np.array([t]), sizes)
        if not len(others):
            return H, np.zeros((0, len(C_v)))
        values = np.linalg.svd(C_v[:, others], compute_uv=False)
        if not values[-1] > DEPENDENT * values[0]:
            joints = ", ".join(name for name in self.names if not name.startswith("modal/"))
            raise SolveError(
                f"{self.model.scene.path}: linear model at t = {t:g} s: {joints} do not determine the posture there (a"
                " singular one)"
            )
        determine = sizes[others, None] * np.linalg.pinv(C_v[:, others])
        H[others] = -determine @ C_v[:, s] / sizes[s]
        return H, determine / rows

    def _inputs(self, H: Array, shares: Mapping[str, FrameShare], points: Mapping[str, Array]) -> Mapping[str, Array]:
        """By s: a unit of each motor, and of forces on points along x, y, z."""
        inputs = {}
        for joint, columns in self.model.motors.items():
            beside = shares[joint].direction @ H if joint in shares else 0.0
            for name, k in zip(coordinate_names(joint, len(columns)), columns, strict=True):
                inputs[name] = self.model.sign(joint) * (H[k] + beside)
        return inputs | self._along_axes("force", points)

    def _outputs(self, state: KnownStates, H: Array, points: Mapping[str, Array]) -> Mapping[str, Array]:
        """By s: joint coordinates, those of motors behind compliant gears, and places of points."""
        tree, rows = self.model.tree, dict[str, Array]()
        for joint in self.model.scene.joint:
            if joint.name in tree.carried:
                sign = tree.nodes[tree.carried[joint.name]].sign
                rows |= {name: sign * H[k] for name, k in labelled(self.model, joint.name)}
        gradients = self.model.along_cut.measured(state.q)[1][0]
        for cut in tree.cut_joints:
            own = [G @ H for one, G in zip(self.model.cut, gradients, strict=True) if one.joint is cut]
            rows |= dict(zip(coordinate_names(cut.name, len(own)), own, strict=True))
        rows |= {f"motor/{gear.joint.joint.name}": H[gear.motor.v.start] for gear in tree.gears}
        return rows | self._along_axes("point", points)

    def _points(self, state: KnownStates, H: Array) -> tuple[dict[str, Array], dict[str, Array]]:
        """(k, f) translations along the axes of the space, then rotations, of each point; (k, k) axes of tools."""
        tree, space, motions, axes = self.model.tree, SPACES[self.model.scene.space], {}, {}
        components = [*space.translations, *(3 + k for k in space.rotations)]
        places = tree.places(np.tile(state.q, (H.shape[1], 1)), H.T)  # a unit of each of s by itself
        for point, place in self.points.items():
            motion = places.at(tree.section(place))
            motions[point] = np.hstack([motion.velocity, motion.omega])[:, components].T
            if place in tree.tools:
                axes[point] = np.kron(np.eye(2), motion.F[0].T)[np.ix_(components, components)]
        return motions, axes

    def _along_axes(self, kind: str, points: Mapping[str, Array]) -> dict[str, Array]:
        """By "KIND/BODY.POINT/x", …: translations of points."""
        axes = SPACES[self.model.scene.space].translations
        return {f"{kind}/{point}/{'xyz'[k]}": J[k] for point, J in points.items() for k in axes}


def labelled(model: Model, joint: str) -> Iterator[tuple[str, int]]:
    """Yield the name of each coordinate of a joint, "joint/NAME" or "joint/NAME 1", …, and its number in v."""
    columns = model.columns(joint)
    yield from zip(coordinate_names(joint, len(columns)), map(int, columns), strict=True)


def _coordinates(model: Model) -> tuple[list[str], Array]:
    """Names of the entries of v, and the sign with which a joint of the scene counts each."""
    names, signs = [""] * model.tree.n_v, np.ones(model.tree.n_v)
    joints = {joint.name for joint in model.scene.joint}
    for node in model.tree.nodes:
        for number, k in enumerate(range(node.v.start, node.v.stop), 1):
            kind = "joint" if node.joint.name in joints else "frame"
            names[k] = f"{kind}/{node.joint.name} {number}"  # of orientations: about axes of the body
        for number, k in enumerate(range(node.p_v.start, node.p_v.stop), 1):
            names[k] = f"modal/{node.body.name}/{number}"
        if node.joint.name in joints:
            for name, k in labelled(model, node.joint.name):
                names[k], signs[k] = name, node.sign
    for gear in model.tree.gears:
        names[gear.motor.v.start] = f"motor/{gear.joint.joint.name}"
    return names, signs


def _independent(model: Model, q: Array) -> Indices:
    """Where s is in v: motors first, then other joints, then modes."""
    modes = np.flatnonzero(~model.tree.joint_columns)
    motors, geared = model.motor_columns, [gear.joint.v.start for gear in model.tree.gears]
    others = np.setdiff1d(np.flatnonzero(model.tree.joint_columns), [*motors, *geared])
    (left,) = model.constraints.natural_gradients(q[None], np.zeros(1), model.natural_sizes)
    size, free = np.abs(left).max(initial=0.0), []
    for group in (others, np.array(geared, int), motors, modes):  # what loops determine best is dependent, modes last
        rank, order = 0, np.arange(len(group))
        if len(left) and len(group):
            Q, R, order = scipy.linalg.qr(left[:, group], pivoting=True)
            rank = int(np.count_nonzero(np.abs(np.diag(R)) > DEPENDENT * size))
            left = Q[:, rank:].T @ left
        free.append(group[order[rank:]])
    return np.concatenate([*map(np.sort, (free[2], np.append(*free[:2]), free[3]))]).astype(np.intp)


def _bracket(nodes: Sequence[Node], v: Array) -> Array:
    """B (n_v, n_v) of velocities (or accelerations) v: −ω~ where three of v turn an orientation."""
    B = np.zeros((len(v), len(v)))
    for node in nodes:
        if node.joint.q_count > node.joint.freedoms:
            turning = slice(node.v.stop - 3, node.v.stop)
            B[turning, turning] = -skew(v[turning])
    return B
