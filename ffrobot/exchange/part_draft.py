"""`ffrobot link PART.step --inspect`: a draft of a link file for a part, with its faces as interfaces."""

import os
from pathlib import Path
from typing import Any

import numpy as np

from ..common.arrays import Array
from ..common.errors import InputError
from ..common.toml_files import toml_text
from ..mesh.checks import METRES
from ..mesh.inspection import Inspection, PartFace

MATERIALS = (("aluminum", 70e9, 0.33, 2700.0), ("steel", 210e9, 0.3, 7850.0), ("titanium", 114e9, 0.34, 4430.0))
"""Name, Young's modulus (Pa), Poisson's ratio and density (kg/m³)."""
AT_END = 1e-3  # of the length: how far a plane end is from the end of the bounding box
ROUND_JOINT = 0.1  # least radius of a bore for a joint, of the part's extent across
SQUARE = 0.1  # largest cosine between the axis of such a bore and the part
ALIKE = 0.02  # relative difference of extents across, below which principal axes are arbitrary
NEARLY = 0.98  # cosine between a normal and a direction that may be the same
DIGITS = 9


def draft_link(part: Inspection, file: Path, name: str, folder: Path, density: float | None = None) -> str:
    """Return a draft of the link file `name` in `folder` for the part in `file`.

    Root and tip are two bores across the part, else its plane ends; other plane faces and bores become comments.
    Concentrated masses, of a file in the unit m alone, are on the nearest face. The stiffness is that of the metal
    nearest to `density` (kg/m³), by default aluminum. Raises `InputError` where nothing can be root and tip.
    """
    root, tip = _ends(part)
    axes, length = _frame(part, root, tip)
    others = {
        f"{face.kind}_{k}": face  # numbered as in the table and the picture
        for k, face in enumerate(part.faces, start=1)
        if face.kind in ("plane", "bore") and face is not root and face is not tip
    }
    mass_on = _masses(part, [root, tip, *others.values()])
    material, about = _material(MATERIALS[0][-1] if density is None else density)

    def interface(label: str, face: PartFace) -> dict[str, Any]:
        position, normal = _numbers(axes @ (face.point - root.point)), _numbers(axes @ face.direction)
        mass = {"mass": mass_on[face]} if face in mass_on else {}
        return {"name": label, "position": position, "normal": normal, **mass}

    keys = {
        "name": name,
        "material": material,
        "geometry": {
            "kind": "solid",
            "file": os.path.relpath(file.resolve(), folder.resolve()),
            "unit": part.unit,
            "length": round(length, DIGITS),
            "origin": _numbers(root.point / METRES[part.unit]),
            "x_axis": _numbers(axes[0]),
            "y_axis": _numbers(axes[1]),
        },
        "reference": {"condition": "cantilever"},
        "modes": {"count": 6},
        "damping": {"ratio": 0.01},
        "interface": [interface("root", root), interface("tip", tip)],
    }
    text = f"# Draft by `ffrobot link {file.name} --inspect`. Check material, unit, root and tip.\n"
    text += f"{about}\n\n{toml_text(keys)}"
    for label, face in others.items():
        table = toml_text({"interface": [interface(label, face)]})
        text += "\n" + "".join(f"# {line}\n" for line in table.strip().splitlines())
    return text


def _material(density: float) -> tuple[dict[str, float], str]:
    name, E, nu, rho = min(MATERIALS, key=lambda one: abs(one[-1] / density - 1.0))
    other = "" if abs(rho / density - 1.0) < 0.1 else f", which is not the material of {density:g} kg/m3: replace it"
    return {"youngs_modulus": E, "poissons_ratio": nu, "density": density}, f"# Stiffness of {name}{other}."


def _principal(part: Inspection) -> tuple[Array, Array]:
    """(3, 3) rows: directions in which the part is longest, then wider, then thinnest; and (3,) its extents there."""
    axes = np.linalg.svd(part.points - part.points.mean(axis=0), full_matrices=False)[2]
    extent = np.ptp(part.points @ axes.T, axis=0)
    order = np.argsort(-extent)
    return axes[order], extent[order]


def _ends(part: Inspection) -> tuple[PartFace, PartFace]:
    """Root and tip: the root is first along the axis of the file that is nearest to the part's."""
    (along, *_), (length, width, _) = _principal(part)
    along = along * np.sign(along[np.abs(along).argmax()])
    bores = [
        face
        for face in part.faces
        if face.kind == "bore" and (face.radius or 0.0) >= ROUND_JOINT * width and abs(face.direction @ along) < SQUARE
    ]
    if len(bores) > 1:
        first, *_, last = sorted(bores, key=lambda face: float(face.center @ along))
        return first, last
    ends = [
        face
        for face in part.faces
        if face.kind == "plane" and ((part.points - face.point) @ face.direction).max() < AT_END * length
    ]
    pairs = [
        ((tip.point - root.point) @ tip.direction, root, tip)
        for root in ends
        for tip in ends
        if root.direction @ tip.direction < SQUARE - 1 and tip.direction @ along > 0
    ]
    if not pairs:
        raise InputError(
            "expected two bores across the part, or plane faces at both of its ends, for root and tip of a draft",
            "neither: write the link file from the faces listed here",
        )
    _, root, tip = max(pairs, key=lambda pair: float(pair[0]))
    return root, tip


def _masses(part: Inspection, faces: list[PartFace]) -> dict[PartFace, float]:
    """The concentrated masses on each face; none if the file is not in m, as its unit of mass is unknown."""
    masses = dict[PartFace, float]()
    for mass in part.masses if part.unit == "m" else ():
        face = min(faces, key=lambda face: float(np.linalg.norm(face.center - mass.point)))
        masses[face] = masses.get(face, 0.0) + mass.mass
    return masses


def _frame(part: Inspection, root: PartFace, tip: PartFace) -> tuple[Array, float]:
    """Axes (3, 3) of the link, rows, and its length: x is square to a plane root, and to the axis of a bore.

    y is square to the axis of the root's bore, else the direction in which the part is thinnest.
    """
    way = tip.point - root.point
    along = (way @ root.direction) * root.direction
    way = along if root.kind == "plane" else way - along
    length = float(np.linalg.norm(way))
    x = way / length
    for z in (root.direction if root.kind == "bore" else _widest(part, x), np.eye(3)[np.abs(x).argmin()]):
        across = z - (z @ x) * x
        if np.linalg.norm(across) >= SQUARE:
            break
    y = np.cross(across / np.linalg.norm(across), x)
    return np.stack([x, y, np.cross(x, y)]), length


def _widest(part: Inspection, x: Array) -> Array:
    """The direction in which the part is wide: the normal of the largest plane face that nearly has it, if any.

    If the part is as thick as wide: the normal of any large face along x, preferably the last axis of the file.
    """
    axes, extent = _principal(part)
    planes = [face for face in part.faces if face.kind == "plane"]
    if extent[2] < (1 - ALIKE) * extent[1]:
        return next((face.direction for face in planes if abs(face.direction @ axes[1]) > NEARLY), axes[1])
    along = [face for face in planes if abs(face.direction @ x) < SQUARE]
    large = [face.direction for face in along if face.area > (1 - ALIKE) * along[0].area]
    return max(large, key=lambda normal: normal[::-1].round(3).tolist(), default=axes[1])


def _numbers(vector: Array) -> list[float]:
    return [value + 0.0 for value in np.round(vector, DIGITS).tolist()]  # no −0.0
