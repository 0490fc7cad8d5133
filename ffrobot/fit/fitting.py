"""`ffrobot fit`: measured frequencies of a link or a robot, the keys to vary, and the new files."""

import json
import re
import tomllib
from collections.abc import Iterator, Mapping, Sequence
from contextlib import contextmanager, suppress
from copy import deepcopy
from dataclasses import replace
from pathlib import Path
from typing import Literal, get_args

import numpy as np
import tomli_w
from rich.console import Console

from ..actuation.control.linear import LinearModels
from ..actuation.control.linear_model import locked_frequencies, robot_modes
from ..common.arrays import Array
from ..common.errors import FfrobotError, InputError, check_known, either
from ..common.files import AnyPath, check_new_file, write_atomically
from ..common.toml_files import load_toml, read_text
from ..common.validation import check_texts
from ..fe_models.link import computed_modal_body
from ..fe_models.link_records.families import FAMILIES
from ..fe_models.link_records.measured import paired, read_measured
from ..fe_models.link_source import LinkTable
from ..present.lines import print_table
from ..run.solve import solve_scene
from ..run.watcher import Watcher
from ..scene.load import load_scene, make_scene
from ..scene.scene import Scene
from ..sweep.files import LINKS, number_at, run_files, set_key
from ..sweep.sweep import Key, check_once
from .least_squares import Fit, Parameters, fit_frequencies

VALUE = r'("[^"\n]*"|[^\s,}\]#]+)'  # a text or a number


def with_values(text: str, changes: Mapping[Key, float | str]) -> str:
    """Return the TOML `text` with other values of keys that are in it.

    Values are replaced in place; where that is impossible, as in lists, the tables are written anew, without comments.
    """
    for key, value in changes.items():
        wanted = deepcopy(tomllib.loads(text))
        set_key(wanted, key, value)
        new, old = json.dumps(value, ensure_ascii=False), text
        for match in re.finditer(rf"(?<![\w.-]){re.escape(key[-1])}\s*=\s*{VALUE}", old):
            text = old[: match.start(1)] + new + old[match.end(1) :]
            with suppress(tomllib.TOMLDecodeError):
                if tomllib.loads(text) == wanted:
                    break
        else:
            text = tomli_w.dumps(wanted)
    return text


class LinkTarget:
    """Eigenmodes of the link file at `path` under its reference condition, in `families` such as bending."""

    families: tuple[str, ...] = FAMILIES

    def __init__(self, path: Path) -> None:
        self._path = path
        self._tables = load_toml(path, "link file")

    def modes(self, changes: dict[Key, float]) -> tuple[tuple[str, ...], Array]:
        """Return families and frequencies (k,), Hz, of the eigenmodes, the lowest first, with some values changed."""
        tables = deepcopy(self._tables)
        for key, value in changes.items():
            set_key(tables, key, value)
        body = computed_modal_body(LinkTable(tables, self._path))
        return body.family[: body.eigenmode_count], body.frequency[: body.eigenmode_count]

    def files(self, changes: dict[Key, float], output: Path | None) -> dict[Path, str]:
        """Return the text of the new link file, by path."""
        return {_beside(self._path, output): with_values(read_text(self._path, "link file"), changes)}


def _fitted_name(path: Path, more: str = "") -> Path:
    return path.with_name(f"{path.stem}{more}.fitted.toml")


def _beside(path: Path, output: Path | None) -> Path:
    if output is not None and output.parent.resolve() != path.parent.resolve():
        raise InputError(f"{output}: output: expected a file next to {path}, to which its file names are relative")
    return output or _fitted_name(path)


class RobotTarget:
    """Vibrations of the scene at `path` about the equilibrium at t = 0, `motors` "free" or "locked"; no `families`."""

    families: tuple[str, ...] = ()

    def __init__(self, path: Path, motors: str) -> None:
        check_known(motors, get_args(Motors), f"motors: expected {either(get_args(Motors))}")
        self._path, self._motors = path, motors
        self._scene = load_toml(path, "scene file")
        load_scene(path)
        bodies = {body["name"]: body.get("link") for body in self._scene["body"]}
        self._links = {name: path.parent / link for name, link in bodies.items() if isinstance(link, str)}

    def scene(self, changes: Mapping[Key, float], kind: str, initial: Mapping[str, object] | None = None) -> Scene:
        """Return the scene with some values changed, one analysis of a `kind`, and entries `initial` of [initial].

        Raises `InputError` for impossible values.
        """
        files = run_files(self._path, changes, self._path.parent)
        scene = files.scene | {"analysis": [{"name": "fit", "kind": kind}]}
        if initial:
            scene["initial"] = scene.get("initial", {}) | initial
        tables = {path.name: link for path, link in files.links.items()}
        for body in scene["body"]:
            if isinstance(file := body.get("link"), str):
                body["link"] = tables.get(file, file)
            if body.get("modes") == "auto":  # the linear model needs no choice: all of them
                del body["modes"]
        return make_scene(folder=self._path.parent, **scene)

    def modes(self, changes: dict[Key, float]) -> tuple[tuple[str, ...], Array]:
        """Return empty families and frequencies (k,), Hz, of k vibrations, lowest first, with some values changed."""
        solution = solve_scene(self.scene(changes, "linear"), Watcher())
        details = solution.outcomes["fit"].details
        assert isinstance(details, LinearModels)
        free = robot_modes(model := details.models[0]).frequency
        frequency = locked_frequencies(model) if self._motors == "locked" else free[free > 0.0]
        return ("",) * len(frequency), frequency

    def files(self, changes: dict[Key, float], output: Path | None) -> dict[Path, str]:
        """Return the texts of the new scene file and of the link files that change, by path."""
        path = _beside(self._path, output)
        of_scene: dict[Key, float | str] = {}
        of_links: dict[str, dict[Key, float | str]] = {}
        for key, value in changes.items():
            if key[0] != LINKS:
                of_scene[key] = value
            elif key[1] in self._links:
                of_links.setdefault(key[1], {})[key[2:]] = value
            else:
                of_scene["body", key[1], "link", *key[2:]] = value
        texts = {}
        for body, values in of_links.items():
            old = self._links[body]
            new = _fitted_name(old, f".{body}")
            texts[new] = with_values(read_text(old, "link file"), values)
            link = next(entry["link"] for entry in self._scene["body"] if entry["name"] == body)
            of_scene["body", body, "link"] = Path(link).with_name(new.name).as_posix()
        return texts | {path: with_values(read_text(self._path, "scene file"), of_scene)}


Motors = Literal["free", "locked"]


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
        motors: state of a robot's motors during the measurement, `free` (the default) or `locked`.
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
    path, table = Path(file), Path(measured)
    is_link = "geometry" in load_toml(path, "link or scene file")
    if is_link and motors is not None:
        raise InputError(f"{path}: --motors: expected a scene file next to it", "a link file")
    target: LinkTarget | RobotTarget = LinkTarget(path) if is_link else RobotTarget(path, motors or "free")
    varied = VariedKeys(path, target, vary, output)
    rows = [row for row in read_measured(table, target.families) if row.frequency is not None]

    def frequencies(values: Array) -> Array:
        with varied.named(values):
            family, frequency = target.modes(varied.changes(values))
        places = {row: k for k, row in paired(rows, family)}
        for row in rows:
            if row not in places:
                raise InputError(
                    f"{table}: line {row.line}: expected modes that the model has ({len(family)} of them)", row.label
                )
        return frequency[[places[row] for row in rows]]

    varied.check_new(replace=force)  # before any work is done
    measured_at = np.array([row.frequency for row in rows], dtype=np.float64)
    spread = np.array([row.uncertainty for row in rows if row.uncertainty is not None])
    if 0 < len(spread) < len(rows):
        raise InputError(f"{table}: uncertainty: expected it of all frequencies or of none", len(spread))
    labels, uncertainty = [row.label for row in rows], spread if len(spread) else None
    fit = fit_frequencies(frequencies, varied.names, varied.start, labels, measured_at, uncertainty)
    return replace(fit, files=varied.write(fit.value))


class VariedKeys:
    """Keys of a link or scene file that `--vary` names; those of one text, "KEY=KEY", have a common factor.

    Attributes:
        names: the texts.
        start: (n,) values of their first keys in the file, in their units.
    """

    def __init__(
        self, path: Path, target: LinkTarget | RobotTarget, vary: Sequence[str], output: AnyPath | None
    ) -> None:
        """Raises `InputError` for keys without a number above 0."""
        self.target, self._place = target, None if output is None else Path(output)
        self._groups = [tuple(tuple(name.strip().split(".")) for name in text.split("=")) for text in vary]
        keys = [key for group in self._groups for key in group]
        if not keys:
            raise InputError("--vary: expected at least one key", "none")
        check_once(keys)
        self._starts = {key: number_at(path, key, "--vary", "link or scene file") for key in keys}
        for key, value in self._starts.items():
            if value <= 0.0:
                raise InputError(f"{path}: --vary: expected a number above 0 at {'.'.join(key)}", f"{value:g}")
        self.names = ["=".join(".".join(key) for key in group) for group in self._groups]
        self.start = np.array([self._starts[group[0]] for group in self._groups])

    def changes(self, values: Array) -> dict[Key, float]:
        """Return the values of all keys by `values` (n,) of each text's first key, in their units."""
        pairs = zip(self._groups, values / self.start, strict=True)
        return {key: float(self._starts[key] * c) for group, c in pairs for key in group}

    @contextmanager
    def named(self, values: Array) -> Iterator[None]:
        """Context that adds the values (n,) of the first keys, in their units, to errors of a model with them."""
        try:
            yield
        except FfrobotError as error:
            at = ", ".join(f"{'.'.join(key)} = {value:.6g}" for key, value in self.changes(values).items())
            raise type(error)(f"with {at}:\n{error}") from None

    @property
    def written(self) -> tuple[Path, ...]:
        """The files that `write` makes, that of the link or scene last."""
        return tuple(self.target.files(self._starts, self._place))

    def check_new(self, *, replace: bool) -> None:
        """Raise `InputError` where a file that `write` makes exists, unless to `replace` it."""
        for new in self.written:
            check_new_file(new, replace=replace)

    def write(self, values: Array) -> tuple[str, ...]:
        """Write files by values (n,) of the first keys, in their units, to 8 digits; return their paths."""
        fitted = {key: float(f"{value:.8g}") for key, value in self.changes(values).items()}
        texts = self.target.files(fitted, self._place)
        for new, text in texts.items():
            write_atomically(new, text.encode(), "fitted file")
        return tuple(map(str, texts))


def print_fit(fit: Parameters, console: Console) -> None:
    """Print tables of parameters and of what was measured, remarks, and the files written."""
    rows = (
        (key, f"{start:.6g}", f"{value:.6g}",
         "not known" if np.isnan(spread) else f"{spread * value:.2g} ({100 * spread:.2g} %)")
        for key, start, value, spread in zip(fit.keys, fit.start, fit.value, fit.relative_deviation, strict=True)
    )  # fmt: skip
    print_table(console, ("key", "start", "fitted", "standard deviation"), rows)
    print_table(console, *fit.comparison())
    for line in (*fit.remarks(), *(f"written: {path}" for path in fit.files)):
        console.out(line)
