"""Stress histories of flexible bodies: modal stresses times modal coordinates (mode displacement method)."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np

from ...common.arrays import Array
from ...fe_models.modal_body import ModalBody

CHUNK_BYTES = 32e6  # of surface stresses at a time; more leaves the cache


@dataclass(frozen=True)
class PointStress:
    """Stress at a point over time, in the body frame; columns xx, yy, zz, yz, xz, xy."""

    stress: Array  # (T, 6) Pa
    von_mises: Array  # (T,) Pa


@dataclass(frozen=True)
class SurfaceStress:
    """Where on the surface the von Mises stress is largest, over time."""

    von_mises_max: Array  # (T,) Pa
    position_of_max: Array  # (T, 3) m, undeformed, in the link's frame


@dataclass(frozen=True)
class BodyStress:
    """Stresses of one body in one analysis, as far as its modal body file has modal stresses."""

    points: Mapping[str, PointStress]
    surface: SurfaceStress | None

    def largest(self) -> tuple[float, int, str]:
        """Largest von Mises stress in Pa, at which output, and where: a point's name or a position on the surface."""
        found = []
        for name, point in self.points.items():
            k = int(np.argmax(point.von_mises))
            found.append((float(point.von_mises[k]), k, name))
        if self.surface is not None:
            k = int(np.argmax(self.surface.von_mises_max))
            place = ", ".join(f"{c:.4g}" for c in self.surface.position_of_max[k])
            found.append((float(self.surface.von_mises_max[k]), k, f"({place}) m"))
        return max(found, key=lambda entry: entry[0])


def body_stress(body: ModalBody, p: Array) -> BodyStress | None:
    """Stresses under modal coordinates p (T, n) of the file; None where it holds no modal stresses."""
    if not body.stress and body.surface_stress is None:
        return None
    points = {}
    for name, point in body.stress.items():
        stress = p @ point.stress.T
        points[name] = PointStress(stress, von_mises(stress))
    surface = None
    if body.surface_stress is not None:
        surface = _surface(body.surface_stress, body.mesh.points, p)
    return BodyStress(points, surface)


def von_mises(stress: Array) -> Array:
    """(…,) von Mises stress of (…, 6) stresses xx, yy, zz, yz, xz, xy."""
    return np.asarray(np.linalg.norm(stress @ _distortion().T, axis=-1))


def _distortion() -> Array:
    """(5, 6) what makes of a stress five numbers whose squares add up to the square of its von Mises stress.

    σ_v² = [σ_xx − (σ_yy + σ_zz)/2]² + ¾ (σ_yy − σ_zz)² + 3 (σ_yz² + σ_xz² + σ_xy²): von Mises 1913, squares completed.
    """
    rows = np.zeros((5, 6))
    rows[0, :3] = 1.0, -0.5, -0.5
    rows[1, 1:3] = np.sqrt(0.75), -np.sqrt(0.75)
    rows[2:, 3:] = np.sqrt(3.0) * np.eye(3)
    return rows


def _surface(modal: Array, positions: Array, p: Array) -> SurfaceStress:
    """From modal stresses (p, 6, n) at positions (p, 3) and modal coordinates (T, n), some outputs at a time."""
    count, _, n = modal.shape
    rows = np.einsum("ab,pbn->apn", _distortion(), modal).reshape(-1, n)
    largest, place = np.zeros(len(p)), np.zeros(len(p), dtype=np.int64)
    step = max(1, int(CHUNK_BYTES / (rows.shape[0] * 8)))
    for start in range(0, len(p), step):
        parts = (rows @ p[start : start + step].T).reshape(5, count, -1)
        squares = np.einsum("apt,apt->pt", parts, parts)
        found = squares.argmax(axis=0)
        place[start : start + step] = found
        largest[start : start + step] = np.sqrt(np.take_along_axis(squares, found[None], axis=0)[0])
    return SurfaceStress(largest, positions[place])
