"""Random trees in 3D that move in a plane, which stands anywhere; offsets and masses across it are anything."""

from dataclasses import replace
from types import MappingProxyType, SimpleNamespace

import numpy as np
from checkpoint_scenes import rpy, tree_model
from material_points import random_cloud
from random_mechanisms import random_beam, random_rigid, random_solid, stiffened
from rotations import random_rotation, rotation_about

from ffrobot.mbs.model.body import Body, BodyPoint, from_modal_body
from ffrobot.mbs.model.projection import projected

TYPES = ("revolute", "prismatic", "planar", "weld")


def flat_solid(rng, name, n=4):
    """Points that modes move across z of the body alone, dense; they move and turn all sections."""
    cloud = random_cloud(rng, name, n=n)
    flat = cloud.Phi * np.array([1.0, 1.0, 0.0])[:, None]
    gram = np.einsum("i,ikm,ikn->mn", cloud.mass, flat, flat)
    body = from_modal_body(name, replace(cloud, Phi=flat @ np.linalg.inv(np.linalg.cholesky(gram)).T).modal_body())
    return replace(body, damping=cloud.damping)


def flat_beam(rng, name, condition="cantilever"):
    """Along x, bending in x, y and along itself."""
    return random_beam(rng, name, (3, 0, 1, 0), condition)


def flat_and_stiffened(rng, name):
    """A solid of which the motion across z, to first and second order, is left out."""
    return projected(stiffened(rng, random_solid(rng, name)))


KINDS = {
    "rigid": random_rigid,
    "solid": flat_solid,
    "beam": flat_beam,
    "supported": lambda rng, name: flat_beam(rng, name, "simply-supported"),
    "stiffened": flat_and_stiffened,
}


def in_other_axes(body, R):
    """The same body in axes that are columns of R (3, 3) in the present ones, lines of mass excepted."""
    T = R.T
    tensor = "ai,bj,ij...->ab..."
    points = {
        label: BodyPoint(T @ at.position, T @ at.translation, T @ at.rotation) for label, at in body.points.items()
    }
    return replace(
        body, first_moment=T @ body.first_moment, second_moment=T @ body.second_moment @ T.T, S_bar=T @ body.S_bar,
        I_bar=np.einsum(tensor, T, T, body.I_bar), S_bar_kl=np.einsum(tensor, T, T, body.S_bar_kl),
        points=MappingProxyType(points),
    )  # fmt: skip


def planar_model(rng, types, kinds=tuple(KINDS), normal=None, joint_keys=None, **scene):
    """A chain or tree of joints of `types` in the plane across `normal` (3,), any where it is not given.

    Bodies "b1" … on joints "j1" …; solids and rigid bodies have axes that stand anyhow to the plane.
    """
    n = random_rotation(rng)[:, 2] if normal is None else np.asarray(normal, dtype=float)
    bodies, tables, normals = [], [], {"ground": n}
    for k, type_ in enumerate(types, 1):
        kind = kinds[rng.integers(len(kinds))]
        body: Body = KINDS[kind](rng, f"b{k}")
        own = np.array([0.0, 0.0, 1.0])
        if kind in ("rigid", "solid"):
            R = random_rotation(rng)
            body, own = in_other_axes(body, R), R.T @ own
        parent = int(rng.integers(k))
        side, label = ("ground", "ground") if not parent else (f"b{parent}", f"b{parent}.{('tip', 'side')[parent % 2]}")
        first = normals[side]
        axes = with_z(first) @ rotation_about(2, rng.uniform(-3, 3)) @ with_z(own).T
        table = {"name": f"j{k}", "type": type_, "between": (label, f"{body.name}.root"), "rpy": rpy(axes)}
        if type_ in ("revolute", "planar"):
            table["axis"] = first.tolist()
        elif type_ == "prismatic":
            table["axis"] = (with_z(first) @ rotation_about(2, rng.uniform(-3, 3)))[:, 0].tolist()
        if label == "ground":
            table["at"] = rng.uniform(-0.5, 0.5, 3).tolist()
        bodies.append(body), tables.append(table | (joint_keys or {}).get(type_, {}))
        normals[body.name] = own
    return tree_model(SimpleNamespace(bodies=bodies), tables, **scene)


def with_z(n):
    """(3, 3) columns, the last n."""
    x = np.cross(n, np.eye(3)[np.argmin(np.abs(n))])
    x /= np.linalg.norm(x)
    return np.column_stack([x, np.cross(n, x), n])
