"""Stage 1 as a command: link file in, modal body file out, and nothing computed that is already there.

Importing this loads no finite element library; they are loaded where a link must be computed.
"""

from __future__ import annotations

import hashlib
import json
import time
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path

from platformdirs import user_cache_path

from ..errors import FfrobotError, SolveError
from ..files import check_output
from ..parallel import on_first, processes
from .link_file import read_link
from .link_records import BeamLink, Link, SolidLink
from .modal_body import ModalBody
from .modal_body_file import FORMAT, FORMAT_VERSION, read_modal_body, write_modal_body

Progress = Callable[[str], None]

# To be raised whenever the same link file gives other numbers than before.
ALGORITHM_VERSION = 2


@dataclass(frozen=True)
class LinkOutcome:
    """What stage 1 did.

    Attributes:
        path: the modal body file.
        body: what it holds.
        computed: False where it was up to date.
        seconds: of wall time, reading and writing included.
    """

    path: Path
    body: ModalBody
    computed: bool
    seconds: float


def input_hash(link: Link) -> str:
    """SHA-256 of what a modal body depends on: the link as checked, defaults filled in, and the program's algorithm.

    A part's file counts by its content. Comments, the order of keys, 1 for 1.0, dates of files change nothing.
    """
    record = link.model_dump(mode="json")
    if isinstance(link, SolidLink) and link.geometry.file is not None:
        record["geometry"]["file"] = hashlib.sha256(link.geometry.file.read_bytes()).hexdigest()
    content = {"format": FORMAT_VERSION, "algorithm": ALGORITHM_VERSION, "link": record}
    return hashlib.sha256(json.dumps(content, sort_keys=True).encode()).hexdigest()


def make_link(
    link_path: Path, output: Path | None = None, force: bool = False, progress: Progress | None = None
) -> LinkOutcome:
    """Bring the modal body file of a link up to date.

    Args:
        link_path: the link file.
        output: where to write; LINK.h5 beside the link file if None.
        force: compute and overwrite in any case.
        progress: is told what is being done, one line a step.

    Under mpirun all processes call; only the first writes, and computes the links that are beams.

    Raises:
        InputError: the link file is wrong, or `output` is some other file that would be lost.
        SolveError: the modes cannot be computed, or the file cannot be written.
    """
    start = time.perf_counter()
    link = read_link(link_path)
    path = output if output is not None else link_path.with_suffix(".h5")
    digest = input_hash(link)
    if not force and on_first(lambda: _up_to_date(path, digest) is not None):
        return LinkOutcome(path, read_modal_body(path), False, time.perf_counter() - start)
    on_first(lambda: check_output(path, FORMAT, force=force))
    return _compute(link, link_path, path, digest, start, progress)


def cached_modal_body(link_path: Path, progress: Progress | None = None) -> LinkOutcome:
    """The modal body of a link: from an up-to-date LINK.h5 beside it, else from the user's cache, else computed.

    Cache entries are named by content: LINK's hash under `ffrobot/links` in the XDG cache folder. A damaged entry is
    computed again.

    Raises:
        InputError: the link file is wrong.
        SolveError: the modes cannot be computed, or the cache cannot be written.
    """
    start = time.perf_counter()
    link = read_link(link_path)
    digest = input_hash(link)
    path = user_cache_path("ffrobot") / "links" / f"{digest}.h5"
    for candidate in (link_path.with_suffix(".h5"), path):
        if (body := _up_to_date(candidate, digest)) is not None:
            return LinkOutcome(candidate, body, False, time.perf_counter() - start)
    return _compute(link, link_path, path, digest, start, progress, make_folder=True)


def _compute(
    link: Link,
    link_path: Path,
    path: Path,
    digest: str,
    start: float,
    progress: Progress | None,
    make_folder: bool = False,
) -> LinkOutcome:
    compute = _computation(link, link_path)  # on all processes: the libraries start together

    def make() -> ModalBody:
        return compute(link, link_path, digest, progress or _silent)

    def write(body: ModalBody) -> None:
        write_modal_body(path, body, make_folder=make_folder)

    if processes() > 1 and isinstance(link, BeamLink):  # too small to share out
        on_first(lambda: write(make()))
        body = read_modal_body(path)
    else:
        body = make()
        on_first(lambda: write(body))
    return LinkOutcome(path, body, True, time.perf_counter() - start)


def _computation(link: Link, link_path: Path) -> Callable[..., ModalBody]:
    try:
        if isinstance(link, BeamLink):
            from .beam_link import beam_modal_body

            return beam_modal_body
        from .solid_link import solid_modal_body

        return solid_modal_body
    except ModuleNotFoundError as error:
        raise SolveError(
            f"{link_path}: computing a link needs the finite element libraries, and {error.name} is not installed: "
            "install dolfinx and slepc4py (Debian: python3-dolfinx python3-slepc4py), or use a modal body file made "
            "elsewhere"
        ) from None


def _up_to_date(path: Path, digest: str) -> ModalBody | None:
    """The modal body in `path` if it is sound and made from the same input."""
    try:
        body = read_modal_body(path)
    except FfrobotError:
        return None
    return body if body.input_hash == digest else None


def _silent(_: str) -> None:
    pass
