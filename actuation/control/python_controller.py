"""A user's own controller: a function in a Python file that is given the setup and returns what is asked at samples.

    def controller(setup):                 # actuation.control.controllers.Setup
        gamma = setup.columns("joint/O")   # where readings are in y, by name
        tau = setup.places("joint/O")      # where commands are in u

        def at_sample(k, y):               # sample number, readings (outputs,)
            u = np.zeros(len(setup.inputs))
            u[tau] = 100 * (setup.reference[k, gamma] - y[gamma])
            return u                       # added to setup.feed_forward[k], then cut at the limits

        return at_sample

It reads the sensors that the scene gives.
"""

from __future__ import annotations

import runpy
import traceback
from collections.abc import Callable
from pathlib import Path

import numpy as np

from ...common.arrays import Array
from ...common.errors import InputError, SolveError
from ...common.python_files import count_failed, count_imports, imported_files
from .controllers import Setup


class PythonControl:
    """Calls what `factory` makes, and checks what it returns. Raises `SolveError` where that fails."""

    bandwidth = 0.0

    def __init__(self, factory: Callable[[Setup], Callable[[int, Array], Array]], setup: Setup, label: str) -> None:
        self.label, self.size, self.times = label, len(setup.inputs), setup.times
        try:
            self.act = factory(setup)
        except (Exception, SystemExit) as error:  # the user's code may raise anything
            raise SolveError(f"{label}: {_in_words(error)}") from error
        if not callable(self.act):
            raise SolveError(f"{label}: expected it to return a function (k, y) → u, found {self.act!r}")

    def __call__(self, k: int, y: Array) -> Array:
        """What the user's function commands at sample k."""
        try:
            u = np.asarray(self.act(k, y), dtype=float)
        except (Exception, SystemExit) as error:  # the user's code may raise anything
            raise SolveError(f"{self._at(k)}: {_in_words(error)}") from error
        if u.shape != (self.size,) or not np.isfinite(u).all():
            raise SolveError(f"{self._at(k)}: expected {self.size} finite commands, found shape {u.shape}: {u}")
        return u

    def _at(self, k: int) -> str:
        return f"{self.label}: sample {k}, t = {self.times[k]:g} s"


def _in_words(error: BaseException) -> str:
    """What the user's code has raised, and in which line."""
    count_failed(error)
    last = traceback.extract_tb(error.__traceback__)[-1]
    return f"{type(error).__name__}: {error} (line {last.lineno} of {Path(last.filename).name}, in {last.name})"


def load_function(reference: str, folder: Path) -> Callable[[Setup], Callable[[int, Array], Array]]:
    """The function of "FILE.py:FUNCTION" of a scene in `folder`.

    What the file imports from below there counts among `python_files.imported_files`. Raises `InputError` where the
    file fails or does not have the function.
    """
    path, _, name = reference.rpartition(":")
    count_imports(folder, Path(path).parent)
    try:
        found = runpy.run_path(path)
    except (Exception, SystemExit) as error:
        raise InputError(f"{path}: controller: {_in_words(error)}") from error
    finally:
        imported_files()  # as they are now
    if not callable(found.get(name)):
        raise InputError(f'{path}: controller: expected the function "{name}", found none')
    function: Callable[[Setup], Callable[[int, Array], Array]] = found[name]
    return function
