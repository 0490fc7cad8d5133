"""Random mechanisms in 3D: trees and loops with every type of joint, of rigid bodies, solids and beams.

Beams are lines of mass with polynomial modes (Ritz) of all four families; solids have modes without any order.
"""

from dataclasses import dataclass, field, replace
from types import MappingProxyType

import numpy as np
from material_points import random_cloud
from numpy.polynomial import Legendre, Polynomial
from rotations import exponential, random_rotation, rotation_about

from ffrobot.mbs.joints.joints import JOINT_TYPES
from ffrobot.mbs.model.body import Body, BodyPoint, Stiffening, bent_section, from_modal_body, rigid_body

TYPES = tuple(JOINT_TYPES)


def random_rigid(rng, name):
    """Mass, center, inertia, and sections "root", "tip", "side" anywhere within a meter."""
    half = rng.uniform(0.2, 1.0, 3)
    turn = random_rotation(rng)
    inertia = turn @ np.diag(half[[1, 2, 0]] + half[[2, 0, 1]]) @ turn.T * 0.1
    points = {label: rng.uniform(-0.5, 0.5, 3) for label in ("root", "tip", "side")}
    return rigid_body(name, rng.uniform(0.5, 2.0), rng.uniform(-0.3, 0.3, 3), inertia, points)


def random_solid(rng, name, n=4):
    """A cloud of points with modes in all directions (dense S_kl, all of J1 and h), dense damping, turning sections.

    Modes move and turn the root as well: as free interfaces do.
    """
    cloud = random_cloud(rng, name, n=n)
    body = from_modal_body(name, cloud.modal_body())
    points = {label: replace(at, rotation=rng.standard_normal((3, n))) for label, at in body.points.items()}
    return replace(body, damping=cloud.damping, points=MappingProxyType(points))


def random_beam(rng, name, modes=(2, 2, 1, 1), condition="cantilever"):
    """A uniform line of mass along x: in-plane and out-of-plane bending, axial motion and twist, `modes` of each."""
    length, mass, I_p = rng.uniform(0.5, 1.5), rng.uniform(0.5, 2.0), rng.uniform(0.001, 0.01)
    bending = Polynomial([0, 0, 1]) if condition == "cantilever" else Polynomial([0, 1, -1])
    factors, densities = (bending, bending, Polynomial([0, 1]), Polynomial([0, 1])), (mass, mass, mass, mass * I_p)
    i, o, a, t = (_shapes(*of) for of in zip(factors, modes, densities, strict=True))
    n, (u, v, w, twist) = sum(modes), np.split(np.arange(sum(modes)), np.cumsum([modes[2], modes[0], modes[1]]))

    def section(xi):
        Phi, Phi_r = np.zeros((3, n)), np.zeros((3, n))
        Phi[0, u], Phi[1, v], Phi[2, w], Phi_r[0, twist] = a(xi), i(xi), o(xi), t(xi)
        Phi_r[2, v], Phi_r[1, w] = i.slope(xi) / length, -o.slope(xi) / length
        return BodyPoint(np.array([xi * length, 0.0, 0.0]), Phi, Phi_r)

    nodes, weights = np.polynomial.legendre.leggauss(20)
    sections = [(section((node + 1) / 2), 0.5 * weight * mass) for node, weight in zip(nodes, weights, strict=True)]
    x = np.array([at.position for at, _ in sections])
    m, Phi = np.array([m for _, m in sections]), np.array([at.translation for at, _ in sections])
    phi = np.array([at.rotation[0] for at, _ in sections])
    return Body(
        name=name,
        mass=mass,
        first_moment=m @ x,
        second_moment=np.einsum("i,ik,il->kl", m, x, x),
        S_bar=np.einsum("i,ikn->kn", m, Phi),
        I_bar=np.einsum("i,ik,iln->kln", m, x, Phi),
        S_bar_kl=np.einsum("i,ikm,iln->klmn", m, Phi, Phi),
        J_spin=mass * I_p,
        h_spin=I_p * m @ phi,
        S_spin=I_p * np.einsum("i,im,in->mn", m, phi, phi),
        stiffness=np.sort(rng.uniform(1, 60, n)),
        damping=np.diag(rng.uniform(0, 0.5, n)),
        points=MappingProxyType({"root": section(0.0), "tip": section(1.0), "side": section(0.6)}),
        modal_transform=np.eye(n),
        length=length,
    )


def symmetric(rng, *shape):
    """Matrices (*shape, n), n the last of `shape`, of numbers of order one."""
    K = rng.standard_normal((*shape, shape[-1]))
    return (K + K.swapaxes(-1, -2)) / 2


def stiffened(rng, body):
    """With terms of second order that its mass can have: of an affine field, and any of its sections but the root's.

    Sections that modes leave alone to first order stay where they are.
    """
    n = body.n_modes
    N = np.block([[np.array([[body.mass]]), body.first_moment[None]], [body.first_moment[:, None], body.second_moment]])
    K = np.einsum("ef,flmn->elmn", N, 0.3 * symmetric(rng, 4, 3, n)) if n else np.zeros((4, 3, 0, 0))
    moved = {label: np.any(at.translation) or np.any(at.rotation) for label, at in body.points.items()}
    points = {label: 0.3 * symmetric(rng, 6, n) * moves if n else np.zeros((6, 0, 0)) for label, moves in moved.items()}
    return replace(body, stiffening=Stiffening(K[0], K[1:], MappingProxyType(points), np.zeros_like(K[1:])))


class _shapes:  # noqa: N801 (reads as a function of x/length)
    """Polynomials that are orthonormal under `density` on 0 … 1: (count,) values, and slopes by x/length."""

    def __init__(self, factor, count, density):
        basis = [factor * Legendre.basis(k, [0, 1]).convert(kind=Polynomial) for k in range(count)]
        products = np.array([[(p * q).integ()(1.0) - (p * q).integ()(0.0) for q in basis] for p in basis])
        self._basis = basis
        self._T = np.linalg.inv(np.linalg.cholesky(density * products)) if count else np.zeros((0, 0))

    def __call__(self, xi):
        return self._T @ np.array([f(xi) for f in self._basis])

    def slope(self, xi):
        return self._T @ np.array([f.deriv()(xi) for f in self._basis])


@dataclass(frozen=True)
class Section:
    """A triad (columns, axes of the section) on a section of a body."""

    body: str
    point: str
    triad: np.ndarray


@dataclass(frozen=True)
class Ground:
    """A triad that stands still, at `position` in m."""

    position: np.ndarray
    triad: np.ndarray
    body = None


@dataclass(frozen=True)
class Joint:
    """A joint of a type of the scene file between triads a and b, h = lead/2π of a screw (m/rad)."""

    name: str
    type: str
    a: object
    b: object
    h: float = 0.0


@dataclass
class JointState:
    """Pose of triad b on a: way d (3,) and axes C (3, 3) in the axes of a; `coordinates` as its type defines them."""

    coordinates: np.ndarray
    d: np.ndarray
    C: np.ndarray


def random_pose(rng, joint):
    """A pose that the joint allows, far from singular ones."""
    angle, other, way, beside = rng.uniform(-1.2, 1.2, 4)
    zero, none = np.zeros(3), np.eye(3)
    turn = rotation_about(2, angle)
    along = np.array([0, 0, way])
    return {
        "revolute": JointState(np.array([angle]), zero, turn),
        "prismatic": JointState(np.array([way]), along, none),
        "screw": JointState(np.array([angle]), np.array([0, 0, joint.h * angle]), turn),
        "cylindrical": JointState(np.array([angle, way]), along, turn),
        "universal": JointState(np.array([angle, other]), zero, rotation_about(0, angle) @ rotation_about(1, other)),
        "spherical": JointState(np.zeros(0), zero, random_rotation(rng)),
        "planar": JointState(np.array([way, beside, angle]), np.array([way, beside, 0]), turn),
        "weld": JointState(np.zeros(0), zero, none),
        "free": JointState(np.zeros(0), rng.uniform(-1, 1, 3), random_rotation(rng)),
    }[joint.type]


@dataclass
class Tree:
    """Bodies, the joints that carry them (joint k carries body k, on its second side), joints that close loops.

    `poses` by joint, modal coordinates `p` by body. Joints without a partner stand on the ground.
    """

    bodies: list
    joints: list
    loops: list = field(default_factory=list)
    poses: dict = field(default_factory=dict)
    p: dict = field(default_factory=dict)

    def placed(self):
        """By body its place R and axes A, where the pose of its joint says."""
        found = {}
        for body, joint in zip(self.bodies, self.joints, strict=True):
            pose, (r, F), (u, E) = self.poses[joint.name], self.triad(joint.a, found), self.bent(joint.b)
            A = F @ pose.C @ E.T
            found[body.name] = r + F @ pose.d - A @ u, A
        return found

    def triad(self, at, placed):
        """Its place and axes."""
        if at.body is None:
            return at.position, at.triad
        (R, A), (u, E) = placed[at.body], self.bent(at)
        return R + A @ u, A @ E

    def bent(self, section):
        """The same in axes of the body, bent by its p."""
        body = next(body for body in self.bodies if body.name == section.body)
        at = bent_section(body, section.point, self.p[body.name])
        return at.u, exponential(at.phi) @ section.triad


def random_body(rng, name, kinds=("rigid", "solid", "beam", "supported beam")):
    kind = kinds[rng.integers(len(kinds))]
    return {
        "rigid": lambda: random_rigid(rng, name),
        "solid": lambda: random_solid(rng, name),
        "beam": lambda: random_beam(rng, name),
        "supported beam": lambda: random_beam(rng, name, (2, 1, 0, 1), "simply-supported"),
        "stiffened solid": lambda: stiffened(rng, random_solid(rng, name)),
        "stiffened beam": lambda: stiffened(rng, random_beam(rng, name)),
        "stiffened supported beam": lambda: stiffened(rng, random_beam(rng, name, (2, 1, 0, 1), "simply-supported")),
    }[kind]()


def random_tree(rng, types, kinds=("rigid", "solid", "beam", "supported beam"), chain=False, loops=0, size=0.1):
    """Bodies b1, b2, … on joints j1, j2, … of `types` in this order, each on the ground or an earlier body.

    Modal coordinates are about `size`. Each of `loops` joins the last body to the ground or an
    earlier body by a joint of any type but weld and free, where it happens to be.
    """
    tree = Tree([], [])
    for k, type_ in enumerate(types, 1):
        body = random_body(rng, f"b{k}", kinds)
        parent = k - 1 if chain else int(rng.integers(k))
        a = Ground(rng.uniform(-0.5, 0.5, 3), random_rotation(rng))
        if parent:
            a = Section(f"b{parent}", ("tip", "side")[rng.integers(2)], random_rotation(rng))
        b = Section(body.name, "root", random_rotation(rng))
        tree.bodies.append(body)
        tree.joints.append(Joint(f"j{k}", type_, a, b, 0.15 if type_ == "screw" else 0.0))
        tree.poses[f"j{k}"] = random_pose(rng, tree.joints[-1])
    tree.p = {body.name: size * rng.standard_normal(body.n_modes) for body in tree.bodies}
    for k in range(1, loops + 1):
        _close_loop(rng, tree, f"loop{k}")
    return tree


def _close_loop(rng, tree, name):
    """A joint from the last body to the ground or another: its section there is made where the loop closes."""
    placed, last = tree.placed(), tree.bodies[-1]
    types = [type_ for type_ in TYPES if type_ not in ("weld", "free")]
    joint = Joint(name, types[rng.integers(len(types))], None, None, 0.1)
    pose, n = random_pose(rng, joint), last.n_modes
    a = Ground(rng.uniform(-0.5, 0.5, 3), random_rotation(rng))
    if len(tree.bodies) > 1 and rng.integers(2):
        a = Section(tree.bodies[int(rng.integers(len(tree.bodies) - 1))].name, "side", random_rotation(rng))
    r, F = tree.triad(a, placed)
    (R, A), p = placed[last.name], tree.p[last.name]
    Phi, Phi_r = 0.3 * rng.standard_normal((3, n)), 0.3 * rng.standard_normal((3, n))
    u = A.T @ (r + F @ pose.d - R)
    points = dict(last.points) | {name: BodyPoint(u - Phi @ p, Phi, Phi_r)}
    tree.bodies[-1] = replace(last, points=MappingProxyType(points))
    _, section = tree.triad(Section(last.name, name, np.eye(3)), placed)
    b = Section(last.name, name, section.T @ F @ pose.C)
    tree.loops.append(replace(joint, a=a, b=b))
    tree.poses[name] = pose
