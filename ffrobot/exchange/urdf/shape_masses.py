"""Shapes and meshes of links: masses of links without <inertial> by a density, and comparison of others."""

import logging
from collections.abc import Iterator, Sequence
from dataclasses import replace
from functools import reduce
from itertools import pairwise
from operator import add
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from ...common.arrays import Array
from ...common.errors import InputError, naming
from ...common.rotations import rpy_of, smallest_turn
from ...common.structs import struct
from ...common.tables import shown
from ...fe_models.modal_body import ModalBody
from ...mesh.skins import loaded_skin
from .robot import MASSLESS, Inertial, MeshFile, Origin, Primitive, Robot, UrdfLink, three

if TYPE_CHECKING:
    import trimesh

logger = logging.getLogger(__name__)

NOT_LOOKED_AT = "meshes were not read, which needs trimesh: pip install trimesh pycollada"


MASSES = "link", "mesh", "mass kg", "volume m³", "implied kg/m³", "inertia: mesh / URDF", "centers apart m"
"""Columns that compare filled meshes with <inertial>; inertia: traces about the centers; implied: density."""


def mesh_masses(robot: Robot, urdf: Path) -> tuple[list[tuple[str, ...]], list[str]]:
    """Return rows of a table with columns `MASSES` for links with meshes and <inertial>; and remarks, a line each."""
    try:
        import trimesh
    except ModuleNotFoundError:
        return [], [NOT_LOOKED_AT] if any(link.visual or link.collision for link in robot.links.values()) else []
    rows, missing, remarks = list[tuple[str, ...]](), list[str](), list[str]()
    for link in robot.links.values():
        meshes = [shape for shape in link.visual or link.collision if isinstance(shape, MeshFile)]
        if link.inertial is None or not link.inertial.mass or not meshes:
            continue
        if absent := [mesh.filename for mesh in meshes if mesh_path(mesh.filename, urdf) is None]:
            missing += absent
            continue
        try:
            mesh = trimesh.util.concatenate([_loaded(mesh, urdf) for mesh in meshes])
        except InputError as error:
            logger.warning("mesh of %s", link.name, exc_info=error)
            remarks.append(f'link "{shown(link.name)}": {error}')
            continue
        mass, tiny = link.inertial.mass, np.finfo(float).tiny
        volume, kind, ratios = abs(float(mesh.volume)), "closed" if _is_closed(mesh) else "open", ("–",) * 3
        if volume < tiny:
            volume, kind = 0.0, "open"
        else:
            unit = mesh.moment_inertia / mesh.volume  # per unit of mass
            ratio = float(np.trace(unit) * mass / max(np.trace(link.inertial.inertia), tiny))
            distance = float(np.linalg.norm(mesh.center_mass - link.inertial.center))
            ratios = f"{mass / volume:.4g}", f"{ratio:.3g}", f"{distance:.2g}"
        rows.append((link.name, kind, f"{mass:.4g}", f"{volume:.3g}", *ratios))
    if missing:
        more = f" and {len(missing) - 1} more" if len(missing) > 1 else ""
        remarks.append(f"mesh not found: {shown(missing[0])}{more}; masses are those of <inertial> in any case")
    return rows, remarks


def mesh_path(filename: str, urdf: Path) -> Path | None:
    """Find the file of a mesh; `package://NAME/…` is searched next to and above the URDF file. None if missing."""
    kind, _, rest = filename.rpartition("://")
    folders = urdf.absolute().parents
    if kind != "package":
        candidates = [folders[0] / rest]
    else:
        package, _, inside = rest.partition("/")
        candidates = [folder / rest for folder in folders]
        candidates += [folder / inside for folder in folders if folder.name == package]
    return next((path for path in candidates if path.is_file()), None)


def _loaded(mesh: MeshFile, urdf: Path) -> "trimesh.Trimesh":
    """The mesh in the axes of its link, m."""
    place, path = mesh.origin.place, mesh_path(mesh.filename, urdf)
    assert path is not None
    return loaded_skin(path, mesh.scale, place.d, place.C)


def _is_closed(mesh: "trimesh.Trimesh") -> bool:
    """Whether the facets enclose a volume, all with the same side out: else integrals are wrong."""
    return bool(mesh.is_watertight and mesh.is_winding_consistent)


SLENDER = 40.0  # bars: length of the longest by their radius
ALIKE = 1e-9  # sections whose sizes differ by less, relative, are one shape


def beam_visuals(body: ModalBody, anchor: Array) -> Iterator[Primitive]:
    """Yield boxes or cylinders that show an undeformed beam, one for each length of constant section.

    `anchor` (3,), m: the link's origin in axes of the body. Outlines with more than four corners become cylinders.
    """
    stations = body.stations
    height = stations.height
    width = height if stations.width is None else stations.width
    is_round = stations.outline is not None and stations.outline.shape[1] > 4
    last = len(height) - 1  # sizes hold from a station to the next
    sizes = np.stack([height, width], axis=1)[:last]
    changes = np.any(np.abs(np.diff(sizes, axis=0)) > ALIKE * sizes.max(), axis=1)
    for first, end in pairwise([0, *(np.flatnonzero(changes) + 1), last]):
        a, b = stations.position[first], stations.position[end]
        length, center = float(np.linalg.norm(b - a)), three((a + b) / 2 - anchor)
        if is_round:
            yield Primitive("cylinder", (float(sizes[first].max()) / 2, length), Origin(center, (0.0, np.pi / 2, 0.0)))
        else:
            yield Primitive("box", (length, float(height[first]), float(width[first])), Origin(center))


def bars(points: Sequence[Array], radius: float) -> Iterator[Primitive]:
    """Yield cylinders of `radius` (m) from the link's origin to `points` (3,), m; a sphere if all coincide with it."""
    away = [point for point in points if np.any(point)]
    for point in away:
        rpy = rpy_of(smallest_turn(point))
        yield Primitive("cylinder", (radius, float(np.linalg.norm(point))), Origin(three(point / 2), three(rpy)))
    if not away:
        yield Primitive("sphere", (2 * radius,), Origin())


@struct
class Filling:
    """Material that fills the shapes of links without mass; SI units."""

    density: float  # kg/m³
    radius: float | None = None  # m, of a cylinder along a link that has no shape of its own; None for no cylinder


def with_masses(robot: Robot, urdf: Path, filling: Filling) -> tuple[Robot, list[str]]:
    """Return the robot with masses of links that lack them, by `filling` of their shapes; and a remark on each.

    Collision shapes are preferred. The root needs no mass. Raises `InputError` for unreadable meshes and
    shapes without a volume.
    """
    links, remarks = dict[str, UrdfLink](robot.links), list[str]()
    for name, link in robot.links.items():
        if name == robot.root or (link.inertial is not None and link.inertial.mass > 0):
            continue
        inertial, what = _filled(robot, link, urdf, filling)
        if inertial is not None:
            links[name] = replace(link, inertial=inertial)
            remarks.append(f'link "{shown(name)}" has no mass: {inertial.mass:.6g} kg by {what}')
    return replace(robot, links=links), remarks


def without_mass(robot: Robot) -> list[str]:
    """Return a remark on each link with shapes but without mass, except the root."""
    return [
        f'link "{shown(name)}" has shapes but no mass: --density estimates it from them'
        for name, link in robot.links.items()
        if name != robot.root and (link.visual or link.collision) and not (link.inertial and link.inertial.mass)
    ]


def _filled(robot: Robot, link: UrdfLink, urdf: Path, filling: Filling) -> tuple[Inertial | None, str]:
    """Mass and inertia of a link, and their source in words; None where its size is unknown."""
    with_density = f"with {filling.density:g} kg/m³"
    for kind, shapes in (("collision", link.collision), ("visual", link.visual)):
        meshes = [shape for shape in shapes if isinstance(shape, MeshFile)]
        if not shapes or (
            filling.radius is not None and any(mesh_path(each.filename, urdf) is None for each in meshes)
        ):
            continue
        label, parts, hulls = f'link "{shown(link.name)}": <{kind}>', list[Inertial](), ""
        for shape in shapes:
            if isinstance(shape, Primitive):
                name, part = f"a {shape.shape}", _of_primitive(shape, filling.density)
            else:
                name, (part, is_hull) = shown(shape.filename), _of_mesh(shape, urdf, filling.density, label)
                hulls = ", convex hulls of meshes that are open or have facets inside out" if is_hull else hulls
            if not (np.isfinite(part.mass) and part.mass > 0):
                raise InputError(f"{label}: expected a shape with a volume", f"{name} without one")
            parts.append(part)
        return reduce(add, parts), f"its <{kind}> filled {with_density}{hulls}"
    beyond = max(robot.joints_of(link.name), key=lambda joint: joint.way, default=None)
    if filling.radius is None or beyond is None or not beyond.way:
        return None, ""
    (rod,) = bars([np.array(beyond.origin.xyz)], filling.radius)
    what = f"a cylinder of radius {filling.radius:g} m to {beyond.label} {with_density}"
    return _of_primitive(rod, filling.density), what


def _of_primitive(shape: Primitive, density: float) -> Inertial:
    """Solid box, cylinder, capsule (centers of half spheres 3/8 radius beyond its cylinder) or sphere."""
    moments: Array
    if shape.shape == "box":
        x, y, z = shape.size
        mass, moments = density * x * y * z, np.array([y * y + z * z, x * x + z * z, x * x + y * y]) / 12
    elif shape.shape in ("cylinder", "capsule"):
        radius, length = shape.size
        across = (3 * radius**2 + length**2) / 12
        mass, moments = density * np.pi * radius**2 * length, np.array([across, across, radius**2 / 2])
        if shape.shape == "capsule":
            ends = density * 4 / 3 * np.pi * radius**3
            across = 0.4 * radius**2 + length**2 / 4 + 3 / 8 * radius * length
            moments = (mass * moments + ends * np.array([across, across, 0.4 * radius**2])) / (mass + ends)
            mass += ends
    else:
        (radius,) = shape.size
        mass, moments = density * 4 / 3 * np.pi * radius**3, np.full(3, 0.4 * radius**2)
    return Inertial(mass, np.zeros(3), mass * np.diag(moments)).seen_from(shape.origin.place)


def _of_mesh(shape: MeshFile, urdf: Path, density: float, label: str) -> tuple[Inertial, bool]:
    """Inertial of a filled mesh in axes of the link, and whether it is that of its convex hull."""
    if mesh_path(shape.filename, urdf) is None:
        raise InputError(
            f"{label}: expected its mesh next to the URDF",
            f"no file {shown(shape.filename)}; --radius takes cylinders where there are no meshes",
        )
    try:
        with naming(label):
            mesh = _loaded(shape, urdf)
    except ModuleNotFoundError:
        raise InputError(f"{label}: masses of meshes need trimesh: pip install trimesh pycollada") from None
    is_closed = _is_closed(mesh)
    try:
        solid = mesh if is_closed else mesh.convex_hull
    except (RuntimeError, ValueError):  # Qhull's, of points in one plane or without numbers
        return MASSLESS, True
    mass = density * float(solid.volume)
    sign = np.sign(mass)  # of a mesh whose faces look inward
    return Inertial(sign * mass, np.array(solid.center_mass), sign * density * solid.moment_inertia), not is_closed
