"""What reference files keep of a results file, and how closely another run has to meet it.

Of each dataset of floats: its largest value, its root mean square, and a dozen samples; of attributes, their values.
"""

import tempfile
from pathlib import Path
from typing import NamedTuple

import h5py
import numpy as np

FOLDER = Path(__file__).with_name("numbers")
SAMPLES = 12
TEXTS = {"actuation", "apply", "columns", "components", "inputs", "integrator", "kind", "lost", "outputs", "status",
         "type", "verdict"}  # fmt: skip
OF_THE_RUN = {"evaluations", "format_version", "peak_time", "moment_time", "rejected", "steps", "wall_seconds"}
"""Attributes that differ between runs that agree: counts, seconds, and times of flat peaks."""

RELATIVE = 1e-6
"""Allowed difference, in parts of the size of its dataset, unless `TOLERANCES` has it by the last part of its name."""
ATTRIBUTES = 2e-2
"""Of attributes and feasibility: peaks and what follows from them are read off between outputs, at times of steps."""
TOLERANCES = {"vibration": 0.3, "start_jolt": 0.1, "voltage": 1e-5, "required_voltage": 1e-5,
              "modal_force": 1e-5}  # fmt: skip
NEGLIGIBLE = 1e-3
"""Datasets smaller than this part of the largest of their name in the analysis, or of its measure, count as that."""
MEASURES = {
    "residual": "modal_force", "residual_force": "modal_force", "unmet_force": "modal_force",
    "modal": "position", "deflection": "position", "predicted_shift": "position", "error": "position",
    "tip_error": "position", "tip_error_max": "position", "tip_error_rms": "position", "overshoot": "position",
    "vibration": "position", "at_start": "position", "moments_repeated": "position",
    "distance": "position", "distance_rms": "position", "mean_power": "rms_power",
    "modal_velocity": "velocity", "strain": "kinetic", "modal_force": "reaction", "mode_required": "reaction",
    "reaction_moment": "reaction", "linear": "velocity", "angular": "angular_velocity",
    "settling_residual": "settling_tolerance", "settling_at_path_end": "settling_tolerance",
    "settling_at_end": "settling_tolerance", "settling_time_to": "settling_path_end",
}  # fmt: skip
"""What numbers may be small against, until only rounding errors of them are left."""
FLOORS = dict.fromkeys(
    ("constraint_violation", "start_jolt", "off_rest", "rotation", "voltage", "required_voltage", "limit"), 1e-3
) | {"field": 1.0, "limited_field": 1.0, "required_moment": 1e-7, "slew": 1.0}
"""Likewise, of numbers without a unit, and V; fields (V/m) and moments (N·m) of patches as of so small voltages, slew
rates (V/s) as of such a voltage within a millisecond."""
SENSITIVE = {
    "arm_under_control": ("patches",),
    "compliant_arm": ("firm_joint",),
    "two_link": ("joints_only",),
    "two_link_fcid": ("straight_forward",),
    "two_link_motors_only": ("joints_only", "redefined"),
    "two_link_points": ("straight_points",),
    "two_link_solid": ("joints_only",),
    "two_link_split": ("limited", "motors"),
}
"""Analyses by reference, most of unstable motions, in which rounding errors grow: without numbers of attributes, and"""
OF_SENSITIVE = 1e-3
"""with this as the allowed difference of their datasets."""
LEFT_OUT = ("saturation_time", "@position_error", "@relative_error", "redefined/bodies/link1/modal_f",
            "redefined/bodies/link2/modal_f", "tracking@unmet")  # fmt: skip
"""Parts of names: times are between outputs, the rule that estimates errors of far bent links is judged by campaigns,
modal forces of an inversion are what its iteration leaves, and those that patches leave in tracking are round-off."""


NEW = "not in the reference"
COINCIDE = 3e-3  # of their size: zeros that are no farther apart; a double one of compliant_arm splits by 1e-3


class Entry(NamedTuple):
    """A dataset or an attribute: its shape, and largest value, root mean square and samples; or a text."""

    shape: tuple[int, ...]
    numbers: np.ndarray
    text: str = ""

    @property
    def size(self):
        """What differences count relative to: the largest value, infinities and gaps aside."""
        return float(np.abs(self.numbers[np.isfinite(self.numbers)]).max(initial=0.0))


def reduced(file):
    """The entries of an open results file, by name; `name@key` for attributes."""
    found = {}

    def visit(name, item):
        if isinstance(item, h5py.Dataset) and item.dtype.kind == "f":
            found[name] = _entry(_apart(item[()]) if "/zeros/" in name else item[()])
        for key, value in item.attrs.items():
            if key not in OF_THE_RUN and (np.asarray(value).dtype.kind in "fib" or key in TEXTS):
                found[f"{name}@{key}"] = _entry(value)

    visit("", file)
    file.visititems(visit)
    return dict(sorted(found.items()))


def of_results(results):
    """The entries of `Results`."""
    with tempfile.TemporaryDirectory() as folder, h5py.File(results.save(Path(folder) / "results.h5")) as file:
        return reduced(file)


def _entry(value):
    values = np.asarray(value)
    if values.dtype.kind not in "fib":
        return Entry(values.shape, np.zeros(0), " ".join(map(str, values.ravel())))
    flat = values.astype(float).ravel()
    if flat.size <= 1:
        return Entry(values.shape, flat)
    finite = flat[np.isfinite(flat)]
    samples = flat[np.linspace(0, flat.size - 1, SAMPLES).astype(int)]
    rms = np.sqrt(np.mean(finite**2)) if finite.size else np.nan
    return Entry(values.shape, np.array([np.abs(finite).max(initial=0.0), rms, *samples]))


def _apart(zeros):
    """(…, n, 2) zeros, those that nearly coincide by their mean: round-off ε moves a double one by √ε, means by ε."""
    z = zeros.reshape(-1, *zeros.shape[-2:]) @ [1.0, 1.0j]
    known = np.isfinite(z)
    with np.errstate(invalid="ignore"):
        near = np.abs(z[:, :, None] - z[:, None]) <= COINCIDE * np.abs(z[:, None])
    near &= known[:, :, None] & known[:, None]
    means = np.einsum("tij,tj->ti", near, np.where(known, z, 0.0)) / np.maximum(near.sum(axis=2), 1)
    return np.where(known[..., None], np.stack([means.real, means.imag], axis=-1), zeros.reshape(*z.shape, 2))


def write(entries, path):
    """Keep entries in a file (npz), of some kB."""
    table = "\n".join("\t".join((name, " ".join(map(str, of.shape)), of.text)) for name, of in entries.items())
    numbers = np.concatenate([of.numbers for of in entries.values()])
    counts = np.array([of.numbers.size for of in entries.values()], dtype=np.uint8)
    np.savez_compressed(path, table=np.frombuffer(table.encode(), np.uint8), counts=counts, numbers=numbers)


def read(path):
    """The entries of such a file."""
    with np.load(path) as file:
        lines = file["table"].tobytes().decode().split("\n")
        parts = np.split(file["numbers"], np.cumsum(file["counts"])[:-1])
    rows = (line.split("\t") for line in lines)
    return {
        name: Entry(tuple(map(int, shape.split())), numbers, text)
        for (name, shape, text), numbers in zip(rows, parts, strict=True)
    }


def path_of(name):
    """The reference file of a scene."""
    return FOLDER / f"{name}.npz"


def differing(name, found):
    """Differences that are not allowed of the entries of a scene from its reference, the worst first."""
    worst_first = differences(found, read(path_of(name)), SENSITIVE.get(name, ()))
    return [difference for difference in worst_first if difference.share > 1]


class Difference(NamedTuple):
    """Of an entry: the largest difference and what is allowed (in units of the quantity), or what is wrong in words."""

    name: str
    apart: float
    allowed: float
    words: str = ""

    @property
    def share(self):
        """Of what is allowed."""
        if self.words or (self.apart and not self.allowed):
            return np.inf
        return self.apart / self.allowed if self.apart else 0.0

    def __str__(self):
        return f"{self.name}: " + (self.words or f"differs by {self.apart:.3g}, allowed {self.allowed:.3g}")


def differences(found, expected, sensitive=()):
    """Of all entries, the worst first; `sensitive`: names of analyses."""
    found, expected = (_compared(entries, sensitive) for entries in (found, expected))
    scales = _scales(expected)
    one_sided = [
        Difference(name, 0.0, 0.0, "missing" if name in expected else NEW) for name in found.keys() ^ expected.keys()
    ]
    both = [_difference(name, found[name], of, scales, sensitive) for name, of in expected.items() if name in found]
    return sorted([*one_sided, *both], key=lambda each: -each.share)


def _compared(entries, sensitive):
    """The entries that are compared: not `LEFT_OUT`, of sensitive analyses no numbers of attributes."""
    return {
        name: of
        for name, of in entries.items()
        if not any(part in name for part in LEFT_OUT)
        and (of.text or "@" not in name or quantity(name)[0] not in sensitive)
    }


def _difference(name, found, expected, scales, sensitive):
    if (found.shape, _words(name, found)) != (expected.shape, _words(name, expected)):
        before, after = (f"{of.shape} {of.text}".strip() for of in (expected, found))
        return Difference(name, 0.0, 0.0, f"expected {before}, found {after}")
    analysis, kind = quantity(name)
    around = max(scales.get((analysis, key), 0.0) for key in (kind, MEASURES.get(kind, kind)))
    size = max(expected.size, NEGLIGIBLE * around, FLOORS.get(kind, 0.0))
    usual = (
        OF_SENSITIVE if analysis in sensitive else ATTRIBUTES if "@" in name or "/feasibility/" in name else RELATIVE
    )
    allowed = max(usual, TOLERANCES.get(kind, 0.0)) * size
    is_same = (found.numbers == expected.numbers) | (np.isnan(found.numbers) & np.isnan(expected.numbers))
    with np.errstate(invalid="ignore"):
        apart = np.where(is_same, 0.0, np.abs(found.numbers - expected.numbers))
    return Difference(name, float(np.nan_to_num(apart, nan=np.inf).max(initial=0.0)), allowed)


def _words(name, of):
    """The text; of integrators in any order: round-off decides which of two that take turns makes the last step."""
    return sorted(of.text.split()) if name.endswith("@integrator") else of.text


def quantity(name):
    """Analysis, and what a dataset or an attribute is of; peaks and means are of their dataset."""
    dataset, _, key = name.partition("@")
    analysis, _, within = dataset.partition("/")
    if within.startswith("settling/"):
        return analysis, f"settling_{key}"
    return analysis, dataset.rpartition("/")[2] if key in ("", "peak", "rms", "mean") else key


def _scales(entries):
    """The largest value by analysis and quantity."""
    found = {}
    for name, of in entries.items():
        found[quantity(name)] = max(found.get(quantity(name), 0.0), of.size)
    return found
