"""Modal forces that no actuator supplies: the links that need them, and how far points are off because of them."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from dataclasses import dataclass, replace

import numpy as np

from ..common.arrays import Array
from ..mbs.model.known_motion import mass_matrices
from ..mbs.model.motors import split_forces
from ..mbs.quantities.motion import RobotMotion

ROWS = 50  # of a run, at most, at which mass matrices are made
RINGING = 2.0  # times the static shift, of a force that is missing all at once


@dataclass(frozen=True)
class Unsupplied:
    """What motors, with the patches that there are, miss of a path whose modal forces nothing supplies.

    Attributes:
        bodies: links without patches or points, or with too few, for the modal forces that were found.
        with_patches: whether any link has patches.
        point: of a trajectory (of any body where trajectories are of angles), the one that misses most.
        angles_kept: m, largest distance from the path where the motors keep the angles that were found, quasi-static.
        at_start: m, likewise at the first output: what the links sag by.
        moments_repeated: m, likewise where they repeat the moments that were found: the first vibration. The robot
            drifts away from there, which no quasi-static estimate knows.
        growth: 1/s, of deviations under these moments (`open_loop_growth`); 0 where none grows, nan if unknown.
        families: in 3D, of each body, those of the modes concerned, in words.
        deflection: in 3D, m, of each, the largest of a point by Φ K⁻¹ r, quasi-static, the link held as its modes are.
        rotation: in 3D, rad, likewise, of a section.
    """

    bodies: tuple[str, ...]
    with_patches: bool
    point: str = ""
    angles_kept: float = 0.0
    at_start: float = 0.0
    moments_repeated: float = 0.0
    growth: float = 0.0
    families: tuple[str, ...] = ()
    deflection: tuple[float, ...] = ()
    rotation: tuple[float, ...] = ()

    @property
    def drift(self) -> str:
        """What becomes of the error where the motors repeat their moments, in words."""
        return f"unstable (growth rate {self.growth:.2g} 1/s)" if self.growth > 0.0 else "drifting"

    @property
    def in_words(self) -> str:
        """What it means, and what to do."""
        links = [
            f"{body} ({families}), off by {_length(deflection)} and {np.degrees(turn):.2g}°"
            for body, families, deflection, turn in zip(
                self.bodies, self.families, self.deflection, self.rotation, strict=True
            )
        ] if self.families else []  # fmt: skip
        of_links = f"{'; '.join(links)}, quasi-static" if links else ", ".join(self.bodies)
        of_point = (
            f" With {'patches within their limits' if self.with_patches else 'motors only'}, {self.point} is off its"
            f" path by {_length(self.angles_kept)} if joints are position-controlled on the computed angles"
            f" ({_length(self.at_start)} at the start), and by {_length(self.moments_repeated)} and {self.drift} if the"
            ' computed torques are applied open loop. kind = "motors-only" finds torques that follow the path'
        )
        return f"no actuator provides all modal forces required on {of_links}.{of_point if self.point else ''}"


def quasi_static_shift(motion: RobotMotion, modal: Mapping[str, Array], points: Iterable[str]) -> dict[str, Array]:
    """Shift (T, 3), m, global axes, of points by modal forces r (T, n) of modal body files, where motors stand still.

    To first order, and slowly: δp = −K⁻¹ r and δr = (∂r/∂p) δp. Vibration that a sudden lack of force starts can be
    twice as large. ∂r/∂p with motors at rest is what a unit force on the point takes of modes (virtual work).
    """
    bent, found = _bent(motion, modal), {}
    for point in points:
        L = motion.section(point).L[:, :3]
        q = np.repeat(motion.q, 3, axis=0)
        by_modes = split_forces(motion.model, q, L.reshape(-1, L.shape[2])).left.reshape(L.shape)
        found[point] = np.einsum("tkn,tn->tk", by_modes, bent)
    return found


def freed_shift(motion: RobotMotion, modal: Mapping[str, Array], point: str, rows: slice) -> Array:
    """The same of one point at these rows, where motors keep their moments: the robot recoils by γ.

    δq = δq_held + R γ with Rᵀ M δq = 0, R = ∂q/∂γ: unmet modal forces do no work while p stands still, and no momentum
    comes from within.
    """
    bent, q, L = _bent(motion, modal)[rows], motion.q[rows], motion.section(point).L[rows, :3]
    T, n_v = bent.shape
    split = split_forces(motion.model, np.repeat(q, n_v, axis=0), np.tile(np.eye(n_v), (T, 1)))
    R = np.concatenate(list(split.moments.values()), axis=1).reshape(T, n_v, -1)
    shift = np.einsum("tkn,tn->tk", split.left.reshape(T, n_v, n_v), bent)
    MR = mass_matrices(motion.model, q) @ R
    gamma = np.linalg.solve(np.swapaxes(R, 1, 2) @ MR, np.einsum("tki,tk->ti", MR, shift)[:, :, None])
    found: Array = np.einsum("tik,tk->ti", L, shift - (R @ gamma)[:, :, 0])
    return found


def seen_at_points(
    about: Unsupplied, motion: RobotMotion, modal: Mapping[str, Array], points: Iterable[str]
) -> Unsupplied:
    """With what modal forces r (T, n) that are left do to these points: `point` is the one that is farthest off."""
    shift = {name: np.linalg.norm(found, axis=1) for name, found in quasi_static_shift(motion, modal, points).items()}
    point = max(shift, key=lambda name: float(shift[name].max()))
    kept, rows = shift[point], slice(None, None, max(1, len(motion.time) // ROWS))
    freed = np.linalg.norm(freed_shift(motion, modal, point, rows), axis=1)
    return replace(
        about,
        point=point,
        angles_kept=float(kept.max()),
        at_start=float(kept[0]),
        moments_repeated=RINGING * float(freed.max()),
    )


def _bent(motion: RobotMotion, modal: Mapping[str, Array]) -> Array:
    """(T, n_v) −K⁻¹ r of the modes of these bodies, else 0."""
    found = np.zeros((len(motion.time), motion.model.tree.n_v))
    for name, r in modal.items():
        node = motion.node(name)
        found[:, node.p_v] = -(r @ node.body.modal_transform) / node.body.stiffness
    return found


def _length(value: float) -> str:
    return f"{1e3 * value:.2g} mm"
