"""The two ways a run can fail, each with the exit code of the command line, and words of their messages."""

import re
from collections.abc import Callable, Collection, Iterable, Iterator
from contextlib import contextmanager
from math import nan
from types import ModuleType
from typing import Any

from .tables import LARGEST, shown


class FfrobotError(Exception):
    """Base of all errors whose message is meant for the user: shown without a traceback.

    `InputError("… expected a number", "text")` is the message "… expected a number, found text".
    """

    __module__ = "ffrobot"  # where users import them from, and tracebacks name them
    exit_code = 1

    def __init__(self, message: object, *found: object) -> None:
        super().__init__(", found ".join(map(str, (message, *found))))


class InputError(FfrobotError):
    """A file, key or value given by the user is wrong: the message names file, key, expected and found."""

    __module__ = "ffrobot"
    exit_code = 2


class SolveError(FfrobotError):
    """An analysis could not be completed: the message states where, why and what to try next."""

    __module__ = "ffrobot"


class FfrobotWarning(UserWarning):
    """Results may be wrong: the message has the reason, the size of the error and a remedy."""

    __module__ = "ffrobot"


class StoppedError(SolveError):
    """A signal ended a run; its results until then are kept."""

    def __init__(self, message: str, number: int) -> None:
        super().__init__(message)
        self.exit_code = 128 + number  # as shells tell it


@contextmanager
def of_file(name: object) -> Iterator[None]:
    """Context that puts the file `name` on errors without one; numerical failures within become `SolveError`.

    NumPy and SciPy raise `LinAlgError` where matrices are singular or not finite, which valid but extreme numbers make.
    """
    from numpy.linalg import LinAlgError

    try:
        yield
    except StoppedError:
        raise
    except (InputError, SolveError) as error:
        first = str(error).partition(":")[0]  # this file, or another one
        if str(error).startswith(str(name)) or str(name).startswith(f"{first}:") or re.search(r"\.[A-Za-z]\w*$", first):
            raise
        raise type(error)(f"{name}: {error}") from error.__cause__
    except (LinAlgError, FloatingPointError) as error:
        raise SolveError(f"{name}: {error}: numbers that differ too much in size, or are too large or small") from error


def is_own_fault(error: BaseException) -> bool:
    """Whether `error` is a fault of the program, since no content of a file that it reads raises such an error.

    These are unknown names, attributes that modules or objects of the program lack, and wrong calls.
    """
    if isinstance(error, AttributeError):
        return isinstance(error.obj, ModuleType) or str(getattr(error.obj, "__module__", "")).startswith("ffrobot")
    if isinstance(error, TypeError):
        return re.search(r"\(\) (missing|takes|got) ", str(error)) is not None
    return isinstance(error, NameError)


@contextmanager
def blaming_file(problem: Callable[[Exception], str]) -> Iterator[None]:
    """Context that turns a reader's exceptions into `InputError` with the text `problem`(error), unless that is empty.

    Faults of the program stay what they are.
    """
    try:
        yield
    except FfrobotError:
        raise
    except Exception as error:
        if is_own_fault(error) or not (text := problem(error)):
            raise
        raise InputError(text) from error


def refuse(lines: Iterable[str], where: object = "") -> None:
    """Raise `InputError` with all `lines`, if there are any, and the file `where` before each."""
    if texts := [f"{where}: {line}" if where else line for line in lines]:
        raise InputError("\n".join(texts))


@contextmanager
def naming(where: object) -> Iterator[None]:
    """Context that puts `where` (file and key) before each line of an `InputError`, unless its text begins so."""
    try:
        yield
    except InputError as error:
        if str(error).startswith(f"{where}:"):
            raise
        raise InputError("\n".join(f"{where}: {line}" for line in str(error).split("\n"))) from error.__cause__


ELSEWHERE = {
    "inverse": "pcid",
    "inverse-dynamics": "pcid",
    "dynamics": "forward",
    "simulate": "forward",
    "simulation": "forward",
    "modal": "linear",
    "eigenvalue": "linear",
    "equilibrium": "static",
    "control": "closed-loop",
}
"""Names that other programs and books use, and those of this program."""


def did_you_mean(word: str, known: Iterable[str]) -> str:
    """` (did you mean "…"?)` with the known word that is close, or begins with `word` and "_"; empty without one."""
    from difflib import get_close_matches

    words = {one.casefold(): one for one in known}
    small = word.casefold()
    close = [one for one in (ELSEWHERE.get(small.replace("_", "-")),) if one in words]
    close = close or get_close_matches(small, words, n=1) or [one for one in words if one.startswith(f"{small}_")]
    return f' (did you mean "{words[close[0]]}"?)' if close else ""


def check_known(word: str, known: Collection[str], expected: str) -> None:
    """Raise `InputError` with the text `expected`, and the word as found, unless `word` is one of `known`."""
    if word not in known:
        raise InputError(expected, f'"{shown(word)}"{did_you_mean(word, known)}')


def finite(value: Any, where: object) -> float:
    """Return `value` as a number. Raises `InputError`, beginning with `where`, unless it is one up to `LARGEST`."""
    try:
        number = nan if isinstance(value, bool) else float(value)
    except (TypeError, ValueError, OverflowError):
        number = nan
    if not abs(number) <= LARGEST:  # False of NaN
        raise InputError(f"{where}: expected a finite number up to {LARGEST:g}", f'"{shown(str(value))}"')
    return number


def quoted(words: Iterable[str]) -> str:
    """Join names for a message: `"a", "b"`; "none" when empty."""
    return ", ".join(f'"{word}"' for word in words) or "none"


def either(words: Iterable[str]) -> str:
    """Join names for a message: `"a", "b" or "c"`."""
    *first, last = (f'"{word}"' for word in words)
    return f"{', '.join(first)} or {last}" if first else last
