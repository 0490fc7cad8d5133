"""The search for the centers of patches on a link that do most: by what they reach, or by the voltages a path takes."""

from __future__ import annotations

from collections.abc import Callable
from itertools import combinations_with_replacement
from math import ceil, comb
from pathlib import Path

import numpy as np

from ...common.arrays import Array, Indices
from ...common.errors import InputError
from ...common.libraries import scipy
from ...common.structs import struct
from ...mbs.run.record import Details
from ..patches.patches import PatchArray
from ..patches.records import PztLayout
from .linear_model import LinearModel
from .placement_records import Placement

SHARE = 0.1  # of a mode's strain energy in the link, for the mode to be its business
CHUNK = 200  # sets whose voltages over the path are held in memory together
SEED = 0  # of the evolution: the same scene gives the same patches
STEPS = 2  # candidates per length of a patch, where the scene gives no spacing


@struct
class PatchableLink:
    """A link that is to get patches, by the m coordinates p that these reach."""

    # name, length: of the link, m
    name: str
    length: float
    bodies: tuple[str, ...]  # whose modal coordinates are those of the link in linear models: itself, or its pieces
    layout: PztLayout  # of the patches
    stiffness: Array  # (m,) of p, and `served` how many of p, the first ones, patches are to serve
    served: int
    own: Array  # (m, n) p from the modal coordinates of the `bodies`, side by side, as linear models have them
    # elsewhere, by the keys "count" or "centers"; `InputError` where they do not fit the link
    patches: Callable[..., PatchArray]


@struct
class Candidates:
    """Places (k,) m for the center of one patch, `gap` of which two patches lie apart at least, and Φ_V there.

    Phi_V (n, k) modal forces per volt, zero columns where the section has a step; `capacitance` (k,) as sensors, F.
    """

    centers: Array
    gap: int
    Phi_V: Array
    capacitance: Array


@struct
class Evaluation:
    """A set of patches: centers (count,) m, reach (modes,) and the value of the criterion, to be as large as can be."""

    centers: Array
    reach: Array
    value: float


@struct
class Placed(Details):
    """Result of a search for patch positions."""

    wanted: Placement  # the keys of the scene
    # best, even: the patches found, and as many spread evenly
    best: Evaluation
    even: Evaluation
    frequency: Array  # (modes,) Hz of the modes that count, and `share` (modes,) of their strain energy in the link
    share: Array
    largest_voltage: Array  # (2,) V of best and even over the path; nan without one
    candidates: Array  # (k,) m centers that were allowed, and `candidate_reach` (modes, k) of a single patch there
    candidate_reach: Array
    sets: int  # how many sets of patches were compared
    method: str  # "all sets" or "evolution"


@struct
class ModalReach:
    """Modes to be reached: frequency (modes,) Hz, shape (modes, n) of the link in them, its share (modes,) in them."""

    frequency: Array
    shape: Array
    share: Array


def locked_modes(model: LinearModel, link: PatchableLink, count: int) -> ModalReach:
    """The lowest modes of the robot with its motors locked in which the link bends."""
    f = model.freedom
    modal = [i for i, name in enumerate(model.state_names[:f]) if name.startswith("modal/")]
    own = [k for body in link.bodies for k, i in enumerate(modal) if model.state_names[i].startswith(f"modal/{body}/")]
    block = np.ix_(modal, modal)
    K = -(model.mass @ model.A[f:, :f])[block]
    squares, shape = scipy.linalg.eigh((K + K.T) / 2, model.mass[block])
    of_link = link.own @ shape[own]
    energy = np.einsum("im,i,im->m", of_link, link.stiffness, of_link)
    share = energy / np.einsum("im,ij,jm->m", shape, (K + K.T) / 2, shape)
    chosen = np.flatnonzero((share > SHARE) & (squares > 0.0))[:count]
    return ModalReach(np.sqrt(squares[chosen]) / (2 * np.pi), of_link[:, chosen].T, share[chosen])


def link_modes(link: PatchableLink, count: int) -> ModalReach:
    """The lowest `count` modes of the link itself, which the voltages of a path must reach."""
    chosen = np.argsort(link.stiffness)[:count]
    return ModalReach(
        np.sqrt(link.stiffness[chosen]) / (2 * np.pi), np.eye(len(link.stiffness))[chosen], np.ones(len(chosen))
    )


def place(
    scene_path: Path,
    wanted: Placement,
    link: PatchableLink,
    model: LinearModel | None,
    F_p: Array | None,
    deviation: Callable[[Array], float] | None = None,
) -> Placed:
    """Find the best centers for the patches of a link; `model` for controllability, F_p (T, m) for voltages.

    `deviation`: of the estimated tip, m, with sensors that read (m, count) V of each unit of p.

    Controllability of a mode is what its gramian grows with under light damping, Σ (φᵀ b_k)² over the patches, b_k the
    modal forces of a patch per volt (Gawronski, Advanced Structural Dynamics, 2004, ch. 4), relative to what the
    best single patch gives the mode: frequencies and damping drop out. Raises `InputError` where there is no room.
    """
    key = f"{scene_path}: placement"
    count = wanted.count or link.layout.patch_count
    modes = wanted.modes or min(count, link.served)
    if link.layout.coupling == "surface":
        raise InputError(f'{key}: expected patches with coupling = "rotation"', '"surface", outlined in the mesh')
    if wanted.pzt not in (None, link.layout.label):
        raise InputError(f'{key}.pzt: expected "{link.layout.label}"', f'"{wanted.pzt}"')
    if modes > link.served or (F_p is not None and modes > count):
        most = link.served if F_p is None else min(count, link.served)
        raise InputError(f"{key}.modes: expected at most {most}", modes)
    candidates = _candidates(scene_path, wanted, link, count)
    reach = locked_modes(model, link, modes) if model is not None else link_modes(link, modes)
    even = link.patches(count=count, centers=None)
    largest = np.square(reach.shape @ candidates.Phi_V).max(axis=1)
    if not np.all(largest > 0.0):
        raise InputError(f'{key}: expected modes that patches on "{link.name}" can reach', "some they cannot")

    def gain(Phi_V: Array) -> Array:
        return np.asarray(np.square(reach.shape @ Phi_V) / largest[:, None])

    def judge(Phi_V: Array, capacitance: Array) -> Array:
        """Values (sets,) of sets of patches, Phi_V (n, sets, count) and capacitances (sets, count)."""
        if deviation is not None:  # by reciprocity the charge of a deflection p is Φ_Vᵀ p
            return -np.array([deviation(volts) for volts in (Phi_V / capacitance).swapaxes(0, 1)])
        if F_p is not None:
            return -_voltages(reach.shape, Phi_V, F_p)
        return _measured(wanted.measure, gain(Phi_V.reshape(len(Phi_V), -1)).reshape(-1, *Phi_V.shape[1:]).sum(axis=2))

    Phi_V, C = candidates.Phi_V, candidates.capacitance
    indices, sets, method = _search(candidates, count, wanted.most_sets, lambda i: judge(Phi_V[:, i], C[i]))
    found = [
        (candidates.centers[indices], Phi_V[:, indices], C[indices]),
        (even.edges.mean(axis=1), even.Phi_V, even.read_capacitance),
    ]
    rated = [Evaluation(x, gain(P).sum(axis=1), float(judge(P[:, None], of[None])[0])) for x, P, of in found]
    voltages = [np.nan if F_p is None else float(_voltages(reach.shape, P[:, None], F_p)[0]) for _, P, _ in found]
    best = 0 if rated[0].value >= rated[1].value else 1  # even spacing need not be on the grid
    return Placed(
        wanted=wanted,
        best=rated[best],
        even=rated[1],
        frequency=reach.frequency,
        share=reach.share,
        largest_voltage=np.array([voltages[best], voltages[1]]),
        candidates=candidates.centers,
        candidate_reach=gain(candidates.Phi_V),
        sets=sets,
        method=method,
    )


def _measured(measure: str, reach: Array) -> Array:
    """Values (sets,) of the reach (modes, sets)."""
    if measure == "worst":
        return np.asarray(reach.min(axis=0))
    if measure == "mean":
        return np.asarray(reach.mean(axis=0))
    with np.errstate(divide="ignore"):
        return np.asarray(np.exp(np.log(reach).mean(axis=0)))


def _voltages(shape: Array, Phi_V: Array, F_p: Array) -> Array:
    """Largest voltage (sets,) that the modes' forces take over a path; voltages of least size where many would do."""
    forces, largest = shape @ F_p.T, []
    for start in range(0, Phi_V.shape[1], CHUNK):
        chunk = np.einsum("mn,nsk->smk", shape, Phi_V[:, start : start + CHUNK])
        reachable = np.linalg.svd(chunk, compute_uv=False)[:, -1] > 0.0
        worst = np.full(len(chunk), np.inf)
        worst[reachable] = np.abs(np.linalg.pinv(chunk[reachable]) @ forces).max(axis=(1, 2), initial=0.0)
        largest.append(worst)
    return np.concatenate(largest)


def _search(
    candidates: Candidates, count: int, most_sets: int, judge: Callable[[Indices], Array]
) -> tuple[Indices, int, str]:
    """The best set of candidates (count,), how many were compared and how.

    y_1 ≤ y_2 ≤ … are the candidates less the room that the patches before them take: every such set is free of overlap.
    """
    room = len(candidates.centers) - (count - 1) * candidates.gap
    offset = candidates.gap * np.arange(count)
    if comb(room + count - 1, count) <= most_sets:
        sets = np.array(list(combinations_with_replacement(range(room), count)), dtype=np.intp) + offset
        return sets[int(np.argmax(judge(sets)))], len(sets), "all sets"

    def decoded(y: Array) -> Indices:
        return np.asarray(np.sort(np.round(y), axis=0).astype(np.intp).T + offset)

    compared = 0

    def cost(y: Array) -> Array | float:
        nonlocal compared
        values = judge(decoded(y).reshape(-1, count))
        compared += len(values)
        lack = -np.nan_to_num(values, neginf=-1e300)
        return lack if y.ndim > 1 else float(lack[0])

    result = scipy.optimize.differential_evolution(
        cost, [(0, room - 1)] * count, integrality=np.ones(count, dtype=bool), vectorized=True, updating="deferred",
        seed=SEED, popsize=30, maxiter=300, tol=1e-8, polish=False,
    )  # fmt: skip
    return decoded(result.x), compared, "evolution"


def _candidates(scene_path: Path, wanted: Placement, link: PatchableLink, count: int) -> Candidates:
    length = link.layout.length
    spacing = wanted.spacing or length / STEPS
    steps = int((link.length - length) / spacing * (1 + 1e-9))
    gap = ceil(length / spacing * (1 - 1e-9))
    if steps < 0 or steps + 1 <= (count - 1) * gap:
        raise InputError(
            f'{scene_path}: placement.count: expected patches that fit side by side on "{link.name}" ({link.length:g}'
            f" m, centers every {spacing:g} m)",
            f"{count} of {length:g} m",
        )
    centers = length / 2 + spacing * np.arange(steps + 1)
    columns, capacitance = np.zeros((len(link.stiffness), len(centers))), np.ones(len(centers))
    for k, center in enumerate(centers):
        try:
            patch = link.patches(count=None, centers=(float(center),))
        except InputError:  # across a step of the section: such a patch does nothing
            continue
        columns[:, k], capacitance[k] = patch.Phi_V[:, 0], patch.read_capacitance[0]
    return Candidates(centers, gap, columns, capacitance)
