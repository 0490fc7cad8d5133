"""Contents of a modal body file, a results file or the file of a part, as text."""

from collections.abc import Iterable, Iterator, Mapping
from io import StringIO
from pathlib import Path
from typing import TYPE_CHECKING

import h5py
import numpy as np
from rich.console import Console
from rich.table import Table

from ..common.arrays import Array
from ..common.errors import InputError
from ..common.hdf5 import datasets_in, open_checked
from ..common.meanings import MODAL_BODY, RESULTS, Meaning, meaning
from ..fe_models.modal_body import Interface, ModalBody
from ..fe_models.modal_body_file import FORMAT as MODAL_FORMAT
from ..fe_models.modal_body_file import read_modal_body
from ..results.file import FORMAT as RESULTS_FORMAT
from ..results.file import Results, status_in_words
from .lines import print_table, tables_of

if TYPE_CHECKING:
    from ..mesh.inspection import Inspection

LISTED = 30  # faces of a part


def describe(path: Path) -> str:
    """Return the contents of a modal body or results file as text. Raises `InputError` for other files."""
    try:
        with open_checked(path) as file:
            kind = file.attrs.get("format")
    except OSError as error:
        reason = f"not a readable HDF5 file ({error})"
        if not path.is_file():
            reason = "a folder" if path.is_dir() else "no such file"
        raise InputError(f"{path}: expected a modal body file or a results file", reason) from None
    if kind == RESULTS_FORMAT:
        with Results(path) as results:
            return _results(results)
    if kind == MODAL_FORMAT:
        with open_checked(path) as file:
            return _modal_body(read_modal_body(path)) + _datasets([file], MODAL_BODY)
    raise InputError(f"{path}: expected a modal body file or a results file", f"format {kind!r}")


def _modal_body(body: ModalBody) -> str:
    center = _place(body, body.first_moment / body.mass)
    lines = [
        f"modal body {body.name!r}: {body.kind}, {body.reference_condition} reference condition, {body.length:g} m",
        f"made by ffrobot {body.ffrobot_version} from input {body.input_hash[:12]}",
        *(f"{name}: {text}" for name in ("assembly", "eigensolver") if (text := getattr(body, name))),
        f"mass {body.mass:.6g} kg, center of mass {center}",
        f"interfaces: {', '.join(_interface(body, name, one) for name, one in body.interfaces.items())}",
        f"stations: {len(body.stations.position)} along the axis",
        f"geometric stiffness: {', '.join(body.geometric_stiffness) or 'none'}",
        *_optional(body),
    ]
    return "\n".join(lines) + "\n" + _rendered(_modes(body))


def _modes(body: ModalBody) -> Table:
    computed = () if body.measured is None else (body.measured.computed_frequency,)
    more = ("of the model (Hz)",) * len(computed)
    table = Table("mode", "family", "frequency (Hz)", *more, "ω (rad/s)", "damping ratio")
    for k, family in enumerate(body.family):
        kind = f"{family}, attachment" if body.residual[k] else family
        frequencies = (f"{of[k]:.6f}" for of in (body.frequency, *computed))
        omega = f"{2 * np.pi * body.frequency[k]:.5f}"
        table.add_row(f"{k + 1}", kind, *frequencies, omega, f"{body.damping_ratio[k]:g}")
    return table


def _interface(body: ModalBody, name: str, interface: Interface) -> str:
    coupling = f" ({interface.coupling})" if interface.coupling else ""
    return f"{name} at {_place(body, interface.position)}{coupling}"


def _place(body: ModalBody, position: Array) -> str:
    """Coordinates (3,) as text, round-off errors of solids as what they are: 0."""
    x, y, z = np.where(np.abs(position) < 1e-12 * body.length, 0.0, position)
    return f"({x:.6g}, {y:.6g}, {z:.6g}) m"


def _optional(body: ModalBody) -> Iterator[str]:
    if body.measured is not None:
        yield f"measured: {body.measured.in_words()}; shapes are those of the model"
    stresses = f"modal{' and static' if body.stress_loads else ''} stresses"
    for name, point in body.stress.items():
        yield f"{stresses} at {name}, {_place(body, point.position)}"
    if body.surface_stress is not None:
        yield f"{stresses} on the surface, at {len(body.surface_stress)} points"
    yield from (f"remark: {remark}" for remark in body.remarks)
    if (patches := body.surface_patches) is not None:
        faces = " and ".join(face for face in ("top", "bottom") if getattr(patches, face) is not None)
        places = ", ".join(f"{start:g} … {end:g}" for start, end in patches.edges)
        yield f"patches outlined in the mesh, {faces}, {patches.width:g} m wide: {places} m"


def _results(results: Results) -> str:
    from ..results.tables import loop_cells  # loads the records of scenes

    lines = [
        f"results of scene {results.name!r}, made by ffrobot {results.ffrobot_version}",
        *(f"body {name}: {body.path} (sha256 {body.sha256[:12]})" for name, body in results.modal_files.items()),
    ]
    headers = "analysis", "kind", "status", "outputs", "up to t (s)", "steps", "evaluations", "wall (s)"
    analyses = Table(*headers)
    for name in results.analyses:
        time, about = results.time(name), results.attributes(name)
        effort = (str(about["steps"]), str(about["evaluations"]), f"{about['wall_seconds']:.3f}")
        analyses.add_row(name, about["kind"], status_in_words(about), f"{len(time)}", f"{time[-1]:g}", *effort)
    tables = map(_rendered, (analyses, *tables_of(results, "closed loop", loop_cells)))
    return "\n".join(lines) + "\n" + "".join(tables) + _datasets(map(results.group, results.analyses), RESULTS)


def _datasets(groups: Iterable[h5py.Group], meanings: Mapping[str, Meaning]) -> str:
    table = Table("dataset", "shape", "unit", "what")
    for group in groups:
        for name, item in datasets_in(group).items():
            known = meaning(name, meanings) or Meaning("", "")
            table.add_row(item.name, str(item.shape), known.unit, known.what)
    return _rendered(table)


def _rendered(table: Table) -> str:
    table.columns[0].no_wrap = True  # names are whole
    Console(file=(out := StringIO()), width=110).print(table, crop=False)
    return out.getvalue()


def print_inspection(file: Path, part: "Inspection", density: float | None, console: Console) -> None:
    """Print unit, extent, volume, mass if `density` (kg/m³) is known, and a table of faces, largest first."""
    said = "" if part.is_declared else ", a guess by its size: --unit sets it"
    size = " × ".join(f"{1000 * value:.6g}" for value in part.high - part.low)
    mass = "" if density is None else f"; mass {density * part.volume:.6g} kg with {density:g} kg/m³"
    lines = [
        f"{file}: drawn in {part.unit}{said}",
        f"extent {size} mm, from {_point(part.low)} to {_point(part.high)} mm",
        f"volume {1e6 * part.volume:.6g} cm³ of the mesh{mass}; center of volume {_point(part.center)} mm",
    ]
    if part.groups:
        lines.append(f"groups {', '.join(part.groups)}")
    for line in (*lines, *(f"remark     {remark}" for remark in part.remarks)):
        console.out(line)
    rows = []
    for k, face in enumerate(part.faces[:LISTED], start=1):
        radius = "–" if face.radius is None else f"{1000 * face.radius:.5g}"
        direction = f"({', '.join(f'{value + 0.0:.4g}' for value in face.direction.round(4))})"
        rows.append((str(k), face.kind, _point(face.center), direction, radius, f"{1e6 * face.area:.5g}"))
    print_table(console, ("face", "kind", "center mm", "normal or axis", "radius mm", "mm² of flat facets"), rows)
    if (more := len(part.faces) - LISTED) > 0:
        console.print(f"and {more} smaller faces")


def _point(place: Array) -> str:
    return f"({', '.join(f'{value + 0.0:.5g}' for value in (1000 * place).round(6))})"
