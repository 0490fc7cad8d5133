"""Stage 1 as a command: link file in, modal body file out, and nothing computed that is already there.

| part | depends on |
|---|---|
| mesh (solids that gmsh meshes: `mesh.kept_parts`) | geometry, mesh, places of interfaces, outlined patches |
| modes, invariants, prestress | the mesh; material, theory, reference condition, attached masses, `[modes]` |
| damping ratios, modal stresses, name, what was measured | the modes; `[damping]`, `[stress]`, `name`, `[measured]` |

Importing this loads no finite element library; they are loaded where a link must be computed.
"""

import time
from collections.abc import Callable, Mapping, Sequence
from contextlib import suppress
from dataclasses import asdict, replace
from functools import partial
from pathlib import Path
from threading import RLock
from typing import Any

import numpy as np

from ..common.cache import cache_folder, is_own
from ..common.errors import FfrobotError, SolveError, of_file
from ..common.files import AnyPath, check_output
from ..common.interrupts import deferred_interrupts, ending_at_once
from ..common.parallel import is_apart, on_first, processes, without_daemon
from ..common.structs import struct
from ..common.validation import plain
from ..common.version import digest_of_code, digest_of_content
from ..mesh.kept_parts import digest_of_mesh_code, geometry_content, kept_path
from .link_file import read_link
from .link_records.families import FAMILIES
from .link_records.link import BeamLink, Link, SolidLink
from .link_records.measured import read_measured
from .link_source import LinkSource, LinkTable, link_path
from .modal_body import ModalBody
from .modal_body.lumped_masses import lumps
from .modal_body.measured import as_computed, damping_ratio, with_measured
from .modal_body.of_link import stress_loads
from .modal_body_file import FORMAT, read_modal_body, write_modal_body

Progress = Callable[[str], None]


@struct
class LinkOutcome:
    """Result of stage 1.

    Attributes:
        path: the modal body file.
        body: its content.
        computed: False if the file was up to date.
        reused: "modes" or "mesh" of an earlier run, or empty.
        seconds: wall time, reading and writing included.
    """

    path: Path
    body: ModalBody
    computed: bool
    seconds: float
    reused: str = ""


def make_link(
    link: AnyPath | LinkTable | Mapping[str, Any],
    output: AnyPath | None = None,
    *,
    force: bool = False,
    progress: Progress | None = None,
) -> LinkOutcome:
    """Compute the modal body of a link unless it is up to date: `ffrobot link`.

    Under mpirun all processes call it; only the first one writes files and computes beams.

    Args:
        link: a link file, or a dictionary of its keys.
        output: modal body file; None: next to the link file, or in the user's cache for a dictionary.
        force: whether to compute it in any case.
        progress: function that receives a line for each step.

    Returns:
        The modal body, its file, and whether it was computed.

    Raises:
        InputError: the link file is invalid, or `output` is a file of another kind.
        SolveError: no modes were found, or the file cannot be written.

    Example:
        body = ffrobot.make_link("arm.toml").body
        body.frequency  # (n,) in Hz
    """
    start = time.perf_counter()
    if isinstance(link, Mapping):
        link = LinkTable(plain(link), Path("<link made in Python>"))
    source: LinkSource = link if isinstance(link, LinkTable) else Path(link)
    checked = read_link(source)
    digest, beside = input_hash(checked), _beside(source)
    cached = _cached(checked)
    path = Path(output) if output is not None else [*beside, cached][0]
    if not force and on_first(lambda: _up_to_date(path, digest, cached) is not None):
        return LinkOutcome(path, read_modal_body(path), False, time.perf_counter() - start)
    if path != cached:
        on_first(lambda: check_output(path, FORMAT))
    earlier = [] if force else [path, *beside]
    return _compute(checked, link_path(source), path, earlier, start=start, progress=progress, force=force)


def cached_modal_body(source: LinkSource, progress: Progress | None = None) -> LinkOutcome:
    """The modal body of a link: from LINK.h5 if up to date, else the user's cache, else computed.

    Cache entries are named by content: hashes of its modes and of all of it, under `ffrobot/links` in the XDG cache
    folder. A damaged entry is computed again. Raises `InputError` for a wrong link file, `SolveError` where the modes
    cannot be computed, or the cache cannot be written.
    """
    start = time.perf_counter()
    link = read_link(source)
    digest, beside, path = input_hash(link), _beside(source), _cached(link)
    for candidate in (*beside, path):
        if (body := _up_to_date(candidate, digest, path)) is not None:
            return LinkOutcome(candidate, body, False, time.perf_counter() - start)
    return _compute(link, link_path(source), path, beside, start=start, progress=progress)


def computed_modal_body(source: LinkSource) -> ModalBody:
    """Compute the modal body of a link by finite elements alone, ignoring measured data and caches.

    Raises `InputError` for a wrong link file, `SolveError` where the modes cannot be computed.
    """
    link, path = read_link(source), link_path(source)
    compute = _computation(link, path, remesh=False)
    with of_file(path), ending_at_once():
        body: ModalBody = compute(link, path, lambda _: None)
    return body


def _beside(source: LinkSource) -> list[Path]:
    return [source.with_suffix(".h5")] if isinstance(source, Path) else []


def _cached(link: Link) -> Path:
    """Where the cache has the modal body of a link, or would have it. Collective."""
    return on_first(lambda: cache_folder("links")) / f"{modes_hash(link)}-{input_hash(link)}.h5"


def _compute(
    link: Link,
    source_path: Path,
    path: Path,
    earlier: Sequence[Path],
    *,
    start: float,
    progress: Progress | None,
    force: bool = False,
) -> LinkOutcome:
    """Make the file at `path`: of the same modes where one of `earlier` or the cache has them, unless `force`."""
    cached = _cached(link)

    def write(body: ModalBody) -> None:
        write_modal_body(path, body, in_cache=path == cached)

    def from_same_modes() -> bool:
        """Whether one of `earlier` or the cache has the same modes: then the file is written from it."""
        wanted = modes_hash(link)
        for one in () if force else (*earlier, *filter(is_own, sorted(cached.parent.glob(f"{wanted}-*.h5")))):
            same = None
            with suppress(FfrobotError):
                body = read_modal_body(one)
                same = restated(body, link) if body.modes_hash == wanted else None
            if same is not None:
                write(same)
                return True
        return False

    if on_first(from_same_modes):
        return LinkOutcome(path, read_modal_body(path), True, time.perf_counter() - start, "modes")
    meshed = on_first(lambda: not force and isinstance(link, SolidLink) and kept_path(link.part(source_path)).is_file())
    compute = _computation(link, source_path, force)  # on all processes: the libraries start together

    def make() -> ModalBody:
        with _ONE_AT_A_TIME, of_file(source_path), ending_at_once():
            body = with_measured(compute(link, source_path, progress or (lambda _: None)), link)
        from ..mesh.compat import assembly
        from .modal_body.krylov_schur import eigensolver

        hashes: dict[str, Any] = {"input_hash": input_hash(link), "modes_hash": modes_hash(link)}
        by = eigensolver("slepc" if isinstance(link, BeamLink) else link.modes.solver)
        return replace(body, **hashes, assembly=assembly(), eigensolver=by)

    if processes() > 1 and isinstance(link, BeamLink):  # too small to share out
        on_first(lambda: write(make()))
        body = read_modal_body(path)
    else:
        body = make()
        on_first(lambda: write(body))
    return LinkOutcome(path, body, True, time.perf_counter() - start, "mesh" if meshed else "")


def _computation(link: Link, source_path: Path, remesh: bool) -> Callable[..., ModalBody]:
    if is_apart() and not isinstance(link, BeamLink):
        raise SolveError(f"{source_path}: expected a solid that ffrobot link has computed before a study under mpirun")
    try:
        without_daemon()
        with ending_at_once(), deferred_interrupts():
            from ..mesh import compat  # noqa: F401 (first of all that load dolfinx)

            if isinstance(link, BeamLink):
                from .beam.link import beam_modal_body

                return beam_modal_body
            from .solid.link import solid_modal_body

            return partial(solid_modal_body, remesh=remesh)
    except ImportError as error:
        gone = f"{error.name} is not installed" if isinstance(error, ModuleNotFoundError) else str(error)
        raise SolveError(
            f"{source_path}: computing this link needs the finite element libraries, and {gone}: install the extra fem"
            " (docs/install.md), or use a modal body file made elsewhere"
        ) from None


def _up_to_date(path: Path, digest: str, cached: Path) -> ModalBody | None:
    """The modal body in `path` if it is sound and made from the same input; if it is `cached`, by this user."""
    if path == cached and not is_own(path):
        return None
    try:
        body = read_modal_body(path)
    except FfrobotError:
        return None
    return body if body.input_hash == digest else None


def is_outdated(path: Path) -> bool:
    """Whether the modal body file LINK.h5 at `path` has a link file LINK.toml beside it that has changed since."""
    with suppress(FfrobotError):
        made_from = read_modal_body(path).input_hash
        return made_from not in ("", input_hash(read_link(path.with_suffix(".toml"))))
    return False


_ONE_AT_A_TIME = RLock()  # gmsh and PETSc know one thread
_AFTER_THE_MODES = ("name", "damping", "stress", "measured")


def input_hash(link: Link) -> str:
    """SHA-256 of all inputs of a modal body: the link with its defaults filled in, and the code that computes it.

    A part's file and a table of measured modes count by their content. Comments, the order of keys, 1 for 1.0, dates
    of files change nothing.
    """
    return _digest(_content(link))


def modes_hash(link: Link) -> str:
    """SHA-256 of the inputs of the modes and their invariants."""
    return _digest({key: value for key, value in _content(link).items() if key not in _AFTER_THE_MODES})


def _content(link: Link) -> dict[str, Any]:
    record = link.model_dump(mode="json")
    if isinstance(link, SolidLink):
        record["geometry"] = geometry_content(link.geometry)
    if link.measured is not None:
        record["measured"] = [asdict(row) for row in read_measured(link.measured.table, FAMILIES)]
    return record


def _digest(record: Mapping[str, Any]) -> str:
    code = {"fe_models": digest_of_code(Path(__file__).parent), "mesh": digest_of_mesh_code()}
    return digest_of_content({"link": record, **code})


def restated(body: ModalBody, link: Link) -> ModalBody | None:
    """Derive the modal body of `link` from `body`, one with the same modes; None where `body` lacks requested data."""
    body = as_computed(body)
    if isinstance(link, BeamLink):  # stresses follow from its stations
        from .beam.stress import beam_stresses  # loads SciPy

        of_modes = np.diag(body.stiffness), body.family, body.eigenmode_count
        attached, at = lumps(link.interface, body.interfaces), body.interfaces
        points = beam_stresses(link, body.stations, *of_modes, attached=attached, interfaces=at)
    else:  # which needs its mesh for them
        known = {tuple(point.position): point for point in body.stress.values() if point.static is not None}
        if not known.keys() >= set(link.stress.points.values()):
            return None
        points = {name: known[position] for name, position in link.stress.points.items()}
    if link.stress.surface and body.surface_static is None:
        return None
    same = replace(
        body,
        name=link.name,
        damping_ratio=damping_ratio(link, np.sqrt(np.diag(body.stiffness))),
        damping_of=link.damping.of,
        stress=points,
        stress_loads=stress_loads(link, body.interfaces),
        surface_stress=body.surface_stress if link.stress.surface else None,
        surface_static=body.surface_static if link.stress.surface else None,
        input_hash=input_hash(link),
    )
    return with_measured(same, link)
