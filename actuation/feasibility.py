"""Can these actuators do it? What is required of patches and motors against what they have, and what would do."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from dataclasses import field as described
from functools import cached_property, partial
from typing import NamedTuple

import numpy as np

from ..common.arrays import Array
from .motors import MotorFeasibility, first_time
from .patches.patches import PatchArray
from .patches.voltages import Voltages
from .unsupplied import Unsupplied

MOST_PATCHES = 200  # that are tried on one link


@dataclass(frozen=True)
class Remedies:
    """What alone would make the patches suffice; infinite or 0 where the word has no meaning.

    Attributes:
        limit: largest voltage, V, of the patch that needs most.
        layers: number of layers of the same thickness, at the same voltage.
        thickness: of one layer, m, with the voltage raised in proportion (at the same field).
        count: patches of the same size, evenly spread; 0 where even as many as have room do not do, or none are tried.
        most_count: as many as have room.
        most_factor: by how much those still fall short.
    """

    limit: float
    layers: int
    thickness: float
    count: int
    most_count: int
    most_factor: float


@dataclass(frozen=True)
class PatchFeasibility:
    """What is asked of the patches of one body in one analysis; k patches, n modes, peaks over time.

    Attributes:
        required_moment, available_moment: (k,) N·m, c times the required voltage, c times the limit.
        saturation_time: (k,) s, when the limit is first exceeded; NaN where it never is.
        field: (k,) V/m in a layer at the required voltage.
        limited_field: (k,) V/m at the voltage within the limit.
        strain: (k,) of the outer surface, from the bending of the link, its mean along the patch.
        mode_required, mode_available: (n,) N/√kg, modal forces: wanted, and with every patch at its limit.
        find_remedies: finds `remedies`.
    """

    required_moment: Array
    available_moment: Array
    saturation_time: Array
    field: Array
    limited_field: Array
    strain: Array
    mode_required: Array
    mode_available: Array
    find_remedies: Callable[[], Remedies] = described(repr=False)

    @cached_property
    def remedies(self) -> Remedies:
        """What would do; found when it is asked for, as it takes longer than all else."""
        return self.find_remedies()

    @property
    def factor(self) -> Array:
        """(k,) required over available moment: above 1 the patch cannot do it."""
        return self.required_moment / self.available_moment

    @property
    def mode_factor(self) -> Array:
        """(n,) required over available modal force: above 1 no voltages within the limits reach it, even alone.

        Infinite where no patch reaches the mode, 0 where nothing is required of it.
        """
        without = np.where(self.mode_required > 0, np.inf, 0.0)
        found: Array = np.divide(self.mode_required, self.mode_available, out=without, where=self.mode_available > 0)
        return found


@dataclass(frozen=True)
class Feasibility:
    """Everything that one analysis asks of the actuators: motors by joint, patches by body.

    `unsupplied` where it asks for modal forces that no actuator is there for: then motors and patches cannot do it,
    whatever their limits.
    """

    motors: dict[str, MotorFeasibility]
    patches: dict[str, PatchFeasibility]
    unsupplied: Unsupplied | None = None

    @property
    def is_feasible(self) -> bool:
        """Whether there are actuators for all that is needed, within their limits."""
        return self.unsupplied is None and not self.short

    @property
    def has_limits(self) -> bool:
        """Whether any motor or patch has a limit."""
        limits = [(of.moment_limit, of.speed_limit, of.power_limit) for of in self.motors.values()]
        return bool(np.isfinite(limits).any()) or any(
            np.isfinite(of.available_moment).any() for of in self.patches.values()
        )

    @property
    def judged(self) -> dict[str, MotorFeasibility | PatchFeasibility]:
        """Every actuator by the name that messages have for it."""
        motors = {f"motor {name}": motor for name, motor in self.motors.items()}
        return {**motors, **{f"patches of {name}": patches for name, patches in self.patches.items()}}

    @property
    def factors(self) -> dict[str, float]:
        """The largest ratio of what is required of each actuator to its limit."""
        return {name: float(np.max(judged.factor)) for name, judged in self.judged.items()}

    @property
    def short(self) -> dict[str, tuple[float, float]]:
        """Actuators that cannot do it: the factor they lack, and from what time on (s)."""
        return {
            name: (factor, float(np.nanmin(self.judged[name].saturation_time)))
            for name, factor in self.factors.items()
            if factor > 1.0
        }


class ModalMotion(NamedTuple):
    """Modal coordinates p and forces F_p (T, n) in the order of the modes of patches, at `time` (T,) s."""

    time: Array
    p: Array
    F_p: Array


def judge_patches(
    patches: PatchArray,
    voltages: Voltages,
    motion: ModalMotion,
    with_count: Callable[[int], float | None] | None,
) -> PatchFeasibility:
    """Required against available of the patches of one layout.

    `with_count(k)` is the largest voltage (V) of k such patches, evenly spread; None where they have no room. Without
    it no other numbers of patches are tried.
    """
    time, p, F_p = motion
    required = np.abs(voltages.required).max(axis=0)
    curvature = np.abs(p @ patches.turn).max(axis=0) / patches.layout.length
    return PatchFeasibility(
        required_moment=np.abs(patches.moment_per_volt) * required,
        available_moment=np.abs(patches.moment_per_volt) * patches.limit,
        saturation_time=first_time(time, np.abs(voltages.required) > patches.limit),
        field=required / patches.layout.thickness,
        limited_field=np.abs(voltages.within_limit).max(axis=0) / patches.layout.thickness,
        strain=patches.lever * patches.surface_distance * curvature,
        mode_required=np.abs(F_p[:, : patches.served]).max(axis=0),
        mode_available=np.abs(patches.Phi_V[: patches.served]) @ patches.limit,
        find_remedies=partial(_remedies, patches, required, with_count),
    )


def _remedies(patches: PatchArray, required: Array, with_count: Callable[[int], float | None] | None) -> Remedies:
    """What limit, layers, thickness or count alone would do, by c ∝ N (t_b + N t_p) for the patch that lacks most."""
    worst = int(np.argmax(required / patches.limit))
    factor = float(required[worst] / patches.limit[worst])
    t_b, t_p, N = float(patches.height[worst]), patches.layout.thickness, patches.layout.layers
    lever = max(factor, 1.0) * N * (t_b + N * t_p)  # of N' (t_b + N' t_p), the layers that would do
    layers = max(N, int(np.ceil((-t_b + np.sqrt(t_b**2 + 4 * t_p * lever)) / (2 * t_p) - 1e-9)))
    lever = max(factor, 1.0) * t_p * (t_b + N * t_p)  # of t (t_b + N t), the thickness that would do
    thickness = (-t_b + np.sqrt(t_b**2 + 4 * N * lever)) / (2 * N)
    count, most, most_factor = (0, len(patches.edges), factor) if with_count is None else _count(patches, with_count)
    return Remedies(float(required[worst]), layers, float(thickness), count, most, most_factor)


def _count(patches: PatchArray, with_count: Callable[[int], float | None]) -> tuple[int, int, float]:
    """The smallest number of patches that do, the largest that has room, and what factor is missing then."""
    most, missing = len(patches.edges), np.inf
    limit = float(patches.limit.min())
    for count in range(patches.served, MOST_PATCHES):
        largest = with_count(count)
        if largest is None:
            break
        most, missing = count, largest / limit
        if missing <= 1.0:
            return count, most, missing
    return 0, most, missing
