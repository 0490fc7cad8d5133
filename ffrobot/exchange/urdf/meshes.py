"""What the meshes of a URDF say of its masses: density, and inertia of the filled mesh against <inertial>.

Meshes are skins: of a hollow casting the implied density is far below that of its metal, and a filled mesh of scaled
density has a stiffness that means nothing. That is why links are rigid unless a link file says otherwise.
"""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from ...common.tables import shown
from ...mesh.skins import loaded_skin
from .robot import Inertial, MeshFile, Robot

if TYPE_CHECKING:
    import trimesh

NOT_LOOKED_AT = "meshes were not read, which needs trimesh: pip install trimesh pycollada"


@dataclass(frozen=True)
class MeshMass:
    """What the mesh of a link makes of its mass.

    Attributes:
        link: its name.
        volume: m³.
        density: that gives the mass of <inertial>, kg/m³.
        inertia_ratio: trace of the filled mesh's inertia about its center over that of <inertial>.
        center_distance: of the two centers, m.
        is_closed: whether the mesh encloses a volume at all.
    """

    link: str
    volume: float
    density: float
    inertia_ratio: float
    center_distance: float
    is_closed: bool


def mesh_masses(robot: Robot, urdf: Path) -> tuple[list[MeshMass], list[str]]:
    """Of every link with a mass and meshes (visual ones, else those for collisions); and remarks, a line each."""
    try:
        import trimesh
    except ModuleNotFoundError:
        return [], [NOT_LOOKED_AT] if any(link.visual or link.collision for link in robot.links.values()) else []
    found, missing, remarks = list[MeshMass](), list[str](), list[str]()
    for link in robot.links.values():
        meshes = [shape for shape in link.visual or link.collision if isinstance(shape, MeshFile)]
        if link.inertial is None or not link.inertial.mass or not meshes:
            continue
        paths = [mesh_path(mesh.filename, urdf) for mesh in meshes]
        if None in paths:
            missing += [mesh.filename for mesh, path in zip(meshes, paths, strict=True) if path is None]
            continue
        try:
            parts = [loaded_mesh(mesh, path) for mesh, path in zip(meshes, paths, strict=True) if path is not None]
        except Exception as error:  # whatever a reader of damaged or unknown files raises
            remarks.append(f'link "{shown(link.name)}": mesh not read: {type(error).__name__}: {shown(str(error))}')
            continue
        found.append(_mass_of(link.name, trimesh.util.concatenate(parts), link.inertial))
    if missing:
        more = f" and {len(missing) - 1} more" if len(missing) > 1 else ""
        remarks.append(f"mesh not found: {shown(missing[0])}{more}; masses are those of <inertial> in any case")
    return found, remarks


def mesh_path(filename: str, urdf: Path) -> Path | None:
    """The file that a URDF means: `package://NAME/…` is looked for beside and above the URDF; None where it is not."""
    kind, _, rest = filename.rpartition("://")
    folders = urdf.absolute().parents
    if kind != "package":
        candidates = [folders[0] / rest]
    else:
        package, _, inside = rest.partition("/")
        candidates = [folder / rest for folder in folders]
        candidates += [folder / inside for folder in folders if folder.name == package]
    return next((path for path in candidates if path.is_file()), None)


def loaded_mesh(mesh: MeshFile, path: Path) -> trimesh.Trimesh:
    """The mesh in the axes of its link, m. Raises `ModuleNotFoundError` without trimesh, else what a reader raises."""
    place = mesh.origin.place
    return loaded_skin(path, mesh.scale, place.d, place.C)


def _mass_of(name: str, mesh: trimesh.Trimesh, inertial: Inertial) -> MeshMass:
    volume = abs(float(mesh.volume))
    if volume < np.finfo(float).tiny:
        return MeshMass(name, 0.0, np.inf, np.nan, np.nan, False)
    unit = mesh.moment_inertia / mesh.volume  # per unit of mass
    ratio = float(np.trace(unit) * inertial.mass / max(np.trace(inertial.inertia), np.finfo(float).tiny))
    distance = float(np.linalg.norm(mesh.center_mass - inertial.center))
    return MeshMass(name, volume, inertial.mass / volume, ratio, distance, bool(mesh.is_watertight))
