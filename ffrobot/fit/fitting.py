"""`ffrobot fit`: measured frequencies of a link or a robot, the keys to vary, and the new files."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import replace
from pathlib import Path
from typing import Literal

import numpy as np
from rich.console import Console

from ..common.arrays import Array, as_floats
from ..common.errors import FfrobotError, InputError
from ..common.files import AnyPath, check_new_file, write_atomically
from ..common.toml_files import load_toml
from ..common.validation import check_texts
from ..fe_models.link_records.measured import MeasuredMode, paired, read_measured
from ..present.lines import print_table
from .least_squares import Fit, fit_frequencies
from .robot_target import Key, LinkTarget, RobotTarget

DIGITS = 8  # of fitted values in files: more than measured ones have

Motors = Literal["free", "held"]


def fit_measured(
    file: AnyPath,
    measured: AnyPath,
    vary: Sequence[str],
    output: AnyPath | None = None,
    *,
    motors: Motors | None = None,
    force: bool = False,
) -> Fit:
    """Fit keys of a link or a scene file to measured natural frequencies: `ffrobot fit`.

    Args:
        file: the link or scene file.
        measured: table with mode, frequency (Hz), and optionally uncertainty (Hz).
        vary: keys with dots; "KEY=KEY" have a common factor.
        output: new file; None: next to the old one, with a name that ends in `.fitted.toml`.
        motors: of a robot during the measurement, `free` (the default) or `held`.
        force: whether to replace existing files.

    Returns:
        Fitted values with their deviations, frequencies before and after, and the new files.

    Raises:
        InputError: files or keys are wrong, frequencies do not distinguish parameters, or a file exists.
        SolveError: no convergence, or a model without frequencies.

    Example:
        fit = ffrobot.fit_measured("arm.toml", "modes.csv", ["material.youngs_modulus"])
        fit.value, fit.relative_deviation
    """
    check_texts(vary, "fit_measured: vary")
    path, table, place = Path(file), Path(measured), None if output is None else Path(output)
    target = _target(path, motors)
    groups = [tuple(tuple(name.strip().split(".")) for name in text.split("=")) for text in vary]
    starts = {key: _start(path, target, key) for group in groups for key in group}
    rows = [row for row in read_measured(table, target.families) if row.frequency is not None]

    def changes(values: Array) -> dict[Key, float]:
        factors = values / np.array([starts[group[0]] for group in groups])
        return {key: float(starts[key] * c) for group, c in zip(groups, factors, strict=True) for key in group}

    def frequencies(values: Array) -> Array:
        try:
            family, found = target.modes(changes(values))
        except FfrobotError as error:
            at = ", ".join(f"{'.'.join(key)} = {value:.6g}" for key, value in changes(values).items())
            raise type(error)(f"with {at}:\n{error}") from None
        return _of_rows(table, rows, family, found)

    for new in target.files(starts, place):  # before any work is done
        check_new_file(new, replace=force)
    keys = ["=".join(".".join(key) for key in group) for group in groups]
    start = np.array([starts[group[0]] for group in groups])
    measured_at = np.array([row.frequency for row in rows], dtype=np.float64)
    found = fit_frequencies(
        frequencies, keys, start, [row.label for row in rows], measured_at, _uncertainty(table, rows)
    )
    texts = target.files({key: float(f"{value:.{DIGITS}g}") for key, value in changes(found.value).items()}, place)
    for new, text in texts.items():
        write_atomically(new, text.encode(), "fitted file")
    return replace(found, files=tuple(map(str, texts)))


def _target(path: Path, motors: Motors | None) -> LinkTarget | RobotTarget:
    tables = load_toml(path, "link or scene file")
    if "geometry" not in tables:
        return RobotTarget(path, motors or "free")
    if motors is not None:
        raise InputError(f"{path}: --motors: expected a scene file next to it, found a link file")
    return LinkTarget(path)


def _start(path: Path, target: LinkTarget | RobotTarget, key: Key) -> float:
    value = target.start(key)
    if isinstance(value, bool) or not isinstance(value, int | float) or value <= 0:
        found = "none" if value is None else repr(value)
        raise InputError(f"{path}: --vary: expected a number above 0 at {'.'.join(key)}, found {found}")
    return float(value)


def _of_rows(path: Path, rows: Sequence[MeasuredMode], family: tuple[str, ...], frequency: Array) -> Array:
    """The frequencies (m,) that belong to the rows."""
    places = {row: k for k, row in paired(list(rows), family)}
    for row in rows:
        if row not in places:
            raise InputError(
                f"{path}: line {row.line}: expected modes that the model has ({len(family)} of them), found {row.label}"
            )
    return as_floats(frequency[[places[row] for row in rows]])


def _uncertainty(path: Path, rows: Sequence[MeasuredMode]) -> Array | None:
    """(m,) Hz, where the table has them."""
    given = [row.uncertainty for row in rows if row.uncertainty is not None]
    if given and len(given) < len(rows):
        raise InputError(f"{path}: uncertainty: expected it of all frequencies or of none, found {len(given)}")
    return np.array(given) if given else None


FEW = 30  # degrees of freedom below which two standard deviations are less than a range of 95 %
ALIKE = 0.95  # correlation of two parameters' errors from which their values are hardly distinguished


def print_fit(fit: Fit, console: Console) -> None:
    """Tables of parameters and modes, remarks, and the files written."""
    parameters = (
        (key, f"{start:.6g}", f"{value:.6g}",
         "not known" if np.isnan(spread) else f"{spread * value:.2g} ({100 * spread:.2g} %)")
        for key, start, value, spread in zip(fit.keys, fit.start, fit.value, fit.relative_deviation, strict=True)
    )  # fmt: skip
    print_table(console, ("key", "start", "fitted", "standard deviation"), parameters)
    modes = (
        (label, *(f"{frequency:.6g}" for frequency in frequencies), f"{100 * error:+.3f} %")
        for label, *frequencies, error in zip(fit.labels, fit.measured, fit.before, fit.after, fit.error, strict=True)
    )
    print_table(console, ("mode", "measured (Hz)", "start (Hz)", "fitted (Hz)", "error"), modes)
    for line in (*remarks(fit), *(f"written: {path}" for path in fit.files)):
        console.print(line, soft_wrap=True)


def remarks(fit: Fit) -> Iterator[str]:
    """What to mind about the numbers."""
    if np.isnan(fit.relative_deviation).any():
        yield (
            "as many frequencies as keys: they fit whatever their errors, so no uncertainty is known; give a column"
            " uncertainty (Hz), or more modes"
        )
    if fit.degrees_of_freedom and fit.degrees_of_freedom < FEW:
        wide, narrow = fit.coverage_factor(0.95), fit.coverage_factor(0.6827)
        yield (
            f"standard deviations are estimated from {fit.degrees_of_freedom} degrees of freedom: the range of 95 % is"
            f" ± {wide:.3g} of them, that of 68 % ± {narrow:.3g} (Student's t); a column"
            " uncertainty (Hz), or more modes, make it narrower"
        )
    for i, j in zip(*np.triu_indices(len(fit.keys), 1), strict=True):
        if abs(fit.correlation[i, j]) > ALIKE:
            yield (
                f"{fit.keys[i]} and {fit.keys[j]} are hardly distinguishable: their errors have a correlation of"
                f" {fit.correlation[i, j]:.4f}"
            )
    if fit.misfit > 2.0:
        yield (
            f"the remaining errors are {fit.misfit:.3g} times the uncertainties: the model lacks something that no"
            " varied key describes"
        )
