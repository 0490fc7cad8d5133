"""Which Python files a scene may run, those below its folder and what the user allows; and what these import."""

from __future__ import annotations

import hashlib
import sys
import sysconfig
from collections.abc import Iterable, Iterator
from contextlib import contextmanager
from contextvars import ContextVar
from pathlib import Path
from traceback import extract_tb
from types import ModuleType

_allowed: ContextVar[tuple[Path, ...]] = ContextVar("python_allowed", default=())

_folders: set[Path] = set()  # whose modules count, of all scenes of this process
_digests: dict[Path, str] = {}  # of the modules seen there, as each was when first seen


@contextmanager
def python_allowed(paths: Iterable[Path]) -> Iterator[None]:
    """Within its context scenes may run these Python files, and those in or below these folders."""
    before = _allowed.get()
    allow_python(paths)
    try:
        yield
    finally:
        _allowed.set(before)


def allow_python(paths: Iterable[Path]) -> None:
    """As `python_allowed`, for good."""
    _allowed.set((*_allowed.get(), *(path.resolve() for path in paths)))


def allowed_python() -> tuple[Path, ...]:
    """What is allowed besides files below the scene's folder."""
    return _allowed.get()


def check_python_file(path: Path, folder: Path) -> None:
    """Raise `ValueError` unless the file at `path`, links resolved, is below the scene's `folder`, or allowed."""
    file = path.resolve()
    if not any(file.is_relative_to(place) for place in (folder.resolve(), *_allowed.get())):
        raise ValueError(
            f'expected a Python file below the scene\'s folder, found "{file}": where you trust it, allow it with'
            f" --allow-python {file.parent}"
        )


def count_imports(*folders: Path) -> None:
    """Have modules in or below `folders`, and below what is allowed, count among `imported_files`."""
    _folders.update(folder.resolve() for folder in (*folders, *_allowed.get()))


def imported_files(*folders: Path) -> dict[Path, str]:
    """SHA-256 of the files, in or below `folders`, of the modules that this process has imported.

    Each as it was when it was seen here first. Without `folders`, of those of all `count_imports`. Installed packages
    and this program do not count.
    """
    for file in filter(None, map(own_file, list(sys.modules.values()))):
        _count(file)
    places = [folder.resolve() for folder in folders] or list(_folders)
    return {file: digest for file, digest in _digests.items() if any(file.is_relative_to(p) for p in places)}


def count_failed(error: BaseException) -> None:
    """Have the files count in which `error` was raised, too: Python forgets a module whose import fails."""
    frames = [frame.filename for frame in extract_tb(error.__traceback__)]
    for file in map(Path, [*frames, *([error.filename or ""] if isinstance(error, SyntaxError) else [])]):
        if file.is_file() and not _is_installed(file.resolve()):
            _count(file.resolve())


def _count(file: Path) -> None:
    if file not in _digests and any(file.is_relative_to(place) for place in _folders):
        _digests[file] = sha256_of(file)


def own_file(module: ModuleType) -> Path | None:
    """The file of a module of the user's: neither the script that runs, nor an installed one, nor of this program."""
    about = vars(module) if isinstance(module, ModuleType) else {}  # some modules load others where they are asked
    name, file, program = about.get("__name__"), about.get("__file__"), __name__.partition(".")[0]
    if not isinstance(file, str) or str(name).partition(".")[0] in ("__main__", "__mp_main__", program):
        return None
    path = Path(file).resolve()
    return None if _is_installed(path) else path


def _is_installed(file: Path) -> bool:
    libraries = {Path(sysconfig.get_path(name)).resolve() for name in ("stdlib", "platstdlib")}
    packages = {"site-packages", "dist-packages"} & set(file.parts)
    return bool(packages) or any(file.is_relative_to(place) for place in libraries)


def sha256_of(file: Path) -> str:
    """SHA-256 of a file's content; "" where it cannot be read."""
    try:
        return hashlib.sha256(file.read_bytes()).hexdigest() if file.is_file() else ""  # a pipe may have no end
    except (OSError, ValueError):  # the latter where it is no name of a file
        return ""
