"""Which Python files a scene may run, what these import, and digests of functions."""

import hashlib
import sys
import sysconfig
from collections.abc import Iterable, Iterator
from contextlib import contextmanager
from contextvars import ContextVar
from functools import cache
from pathlib import Path
from traceback import walk_tb
from types import CodeType, ModuleType
from typing import Any

import numpy as np

_allowed: ContextVar[tuple[Path, ...]] = ContextVar("python_allowed", default=())

_folders: set[Path] = set()  # whose modules count, of all scenes of this process
_digests: dict[Path, str] = {}  # of the modules seen there, as each was when first seen


@contextmanager
def python_allowed(paths: Iterable[Path]) -> Iterator[None]:
    """Context in which scenes may run the Python files among `paths`, and in or below the folders among them."""
    before = _allowed.get()
    allow_python(paths)
    try:
        yield
    finally:
        _allowed.set(before)


def allow_python(paths: Iterable[Path]) -> None:
    """Allow scenes to run the Python files of `paths`, as `python_allowed`, but until the program ends."""
    _allowed.set((*_allowed.get(), *(path.resolve() for path in paths)))


def allowed_python() -> tuple[Path, ...]:
    """Files, and folders of files, that scenes may run besides Python files in their own folder."""
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
    """Have `imported_files` list imports from `folders`, too, and from those of `allowed_python`."""
    _folders.update(folder.resolve() for folder in (*folders, *_allowed.get()))


def imported_files(*folders: Path) -> dict[Path, str]:
    """SHA-256, by file, of modules in or below `folders` that this process has imported.

    Each is of the file as it was when seen here first. Without `folders`: those of all `count_imports`. Installed
    packages and ffrobot itself are left out.
    """
    if not _folders:  # before anything else: finding the files of all modules takes longer than many a run
        return {}
    for file in filter(None, map(own_file, list(sys.modules.values()))):
        _count(file)
    places = [folder.resolve() for folder in folders] or list(_folders)
    return {file: digest for file, digest in _digests.items() if any(file.is_relative_to(p) for p in places)}


def count_failed(error: BaseException) -> str:
    """Have `imported_files` list the user's files that raised `error`: Python forgets a module whose import fails.

    Returns "line L of FILE, in FUNCTION" of the innermost of them, "" where there is none.
    """
    last, program = "", __name__.partition(".")[0]
    for frame, line in walk_tb(error.__traceback__):
        if frame.f_globals["__name__"].partition(".")[0] != program and (
            file := _failed_file(frame.f_code.co_filename)
        ):
            last = f"line {line} of {file.name}, in {frame.f_code.co_name}"
    if isinstance(error, SyntaxError):  # which names its line itself
        _failed_file(error.filename or "")
    return last


def _failed_file(name: str) -> Path | None:
    """The file of that name, which counts, where it is one of the user's."""
    file = Path(name)
    if not file.is_file() or _is_installed(file.resolve()):
        return None
    _count(file.resolve())
    return file


def _count(file: Path) -> None:
    if file not in _digests and any(file.is_relative_to(place) for place in _folders):
        _digests[file] = sha256_of(file)


def own_file(module: ModuleType) -> Path | None:
    """The file of a module of the user's; None of the script that runs, installed modules and those of ffrobot."""
    about = vars(module) if isinstance(module, ModuleType) else {}  # some modules load others where they are asked
    name, file, program = about.get("__name__"), about.get("__file__"), __name__.partition(".")[0]
    if not isinstance(file, str) or str(name).partition(".")[0] in ("__main__", "__mp_main__", program):
        return None
    return _unless_installed(file)


@cache
def _unless_installed(file: str) -> Path | None:
    path = Path(file).resolve()
    return None if _is_installed(path) else path


def _is_installed(file: Path) -> bool:
    packages = {"site-packages", "dist-packages"} & set(file.parts)
    return bool(packages) or any(file.is_relative_to(place) for place in _libraries())


@cache
def _libraries() -> frozenset[Path]:
    return frozenset(Path(sysconfig.get_path(name)).resolve() for name in ("stdlib", "platstdlib"))


def sha256_of(file: Path) -> str:
    """SHA-256 of a file's content; "" where it cannot be read."""
    try:
        return hashlib.sha256(file.read_bytes()).hexdigest() if file.is_file() else ""  # a pipe may have no end
    except (OSError, ValueError):  # the latter where it is no name of a file
        return ""


DEPTH = 6  # of functions in functions, lists in lists


def digest_of_function(function: object) -> str:
    """Hash (12 digits) of a function: code, constants, defaults, enclosed and global values.

    The user's own modules that the function names count with the content of their files.
    """
    digest = hashlib.sha256()
    for part in _parts(function, DEPTH):
        digest.update(part + b"\0")
    return digest.hexdigest()[:12]


def _parts(value: Any, depth: int) -> Iterator[bytes]:
    if depth == 0:
        return
    code = getattr(value, "__code__", None)
    if isinstance(value, np.ndarray):
        yield repr((value.dtype.str, value.shape)).encode() + value.tobytes()
    elif value is None or isinstance(value, bool | int | float | complex | str | bytes | np.generic):
        yield repr(value).encode()
    elif isinstance(value, list | tuple | set | frozenset):
        for item in sorted(value, key=repr) if isinstance(value, set | frozenset) else value:
            yield from _parts(item, depth - 1)
    elif isinstance(value, dict):
        for key, item in value.items():
            yield repr(key).encode()
            yield from _parts(item, depth - 1)
    elif isinstance(code, CodeType):
        yield from _function(value, code, depth)
    elif hasattr(value, "__wrapped__") or hasattr(value, "func"):  # compiled by numba, functools.partial
        for name in ("__wrapped__", "func", "args", "keywords"):
            yield from _parts(getattr(value, name, None), depth - 1)
    elif isinstance(value, ModuleType):
        yield value.__name__.encode()
        if (file := own_file(value)) is not None:
            yield sha256_of(file).encode()
    else:  # an object that can be called: by its name and what it holds
        yield f"{type(value).__module__}.{type(value).__qualname__}".encode()
        if type(value).__name__ not in ("type", "builtin_function_or_method"):
            yield from _parts(getattr(type(value).__call__, "__func__", type(value).__call__), depth - 1)
            yield from _parts(getattr(value, "__dict__", None), depth - 1)


def _function(function: Any, code: CodeType, depth: int) -> Iterator[bytes]:
    yield from _code(code)
    for cell in getattr(function, "__closure__", None) or ():
        yield from _parts(_content(cell), depth - 1)
    for values in (getattr(function, "__defaults__", None), getattr(function, "__kwdefaults__", None)):
        yield from _parts(values, depth - 1)
    known = getattr(function, "__globals__", {})
    for name in sorted(_names(code)):
        if name in known:
            yield name.encode()
            yield from _parts(known[name], depth - 1)
    yield from _parts(getattr(getattr(function, "__self__", None), "__dict__", None), depth - 1)


def _code(code: CodeType) -> Iterator[bytes]:
    yield code.co_code
    yield repr(code.co_names).encode()
    for constant in code.co_consts:
        if isinstance(constant, CodeType):
            yield from _code(constant)
        elif isinstance(constant, frozenset):  # in another order in every process
            yield repr(sorted(constant, key=repr)).encode()
        else:
            yield repr(constant).encode()


def _names(code: CodeType) -> set[str]:
    inner = (constant for constant in code.co_consts if isinstance(constant, CodeType))
    return set(code.co_names).union(*map(_names, inner))


def _content(cell: Any) -> object:
    try:
        return cell.cell_contents
    except ValueError:  # empty yet
        return None
