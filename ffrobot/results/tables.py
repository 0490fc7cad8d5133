"""Tables of a results file as terminal and report have them: rows of text by their headings."""

from collections.abc import Iterator

import numpy as np

from .file import Results, status_in_words
from .verdict import millimeters, vibrates

Cells = dict[str, str]
"""A row by heading, without the name of the analysis."""


def analysis_cells(results: Results, analysis: str) -> Iterator[Cells]:
    """Yield the table row of an analysis: status, integrator, steps, tolerance, wall time."""
    from ..mbs.run.integrators import Choice  # loads the core
    from .judging import end_of  # likewise

    about, time = results.attributes(analysis), results.time(analysis)
    integrated, violation = about["integrator"] != "none", results[f"{analysis}/constraint_violation"]
    of_steps = {key: f"{about.get(key, '')}" if integrated else "" for key in ("steps", "rejected", "evaluations")}
    asked = "" if about["status"] == "completed" else f" of {end_of(results.scene, analysis):g}"
    yield {
        "kind": str(about["kind"]),
        "status": status_in_words(about),
        "integrator": Choice(str(about["integrator"]), "").in_words if integrated else "",
        "end (s)": f"{time[-1]:g}{asked}",
        "outputs": f"{len(time)}",
        **of_steps,
        "tolerance": f"{about['tolerance']:.0e}" if integrated else "",
        "constraint\nviolation": f"{most:.0e}" if (most := violation.max(initial=0.0)) else "0",
        "wall (s)": f"{about['wall_seconds']:.3f}",
    }


def voltage_cells(results: Results, analysis: str) -> Iterator[Cells]:
    """Yield a table row for each layout: required voltage, limit, their ratio."""
    for layout in results.names(f"{analysis}/pzt"):
        group = f"{analysis}/pzt/{layout}"
        about, patches = results.attributes(group), range(results[f"{group}/required_voltage"].shape[1])
        required = np.array([results.peak(f"{group}/required_voltage[{k}]")[0] for k in patches])
        limits = np.atleast_1d(about["limit"])  # one for all patches, or one each
        is_limited = np.isfinite(limits).any()
        span = " to ".join(dict.fromkeys((f"{limits.min():g}", f"{limits.max():g}")))
        ratio = np.max(required / limits)
        if "range" in about:
            span = f"{about['range'][0].max():g} to {about['range'][1].min():g}"
            ratio = max(ratio, np.max(results[f"{group}/required_voltage"][:, None] / about["range"]))
        yield {
            "on": layout,
            "largest (V)": volts(required.max()),
            "limit (V)": span if is_limited else "none",
            "required /\nlimit": f"{ratio:.3g}" if is_limited else "",
            "condition\nnumber": f"{about['condition_number']:.3g}",
        }


def placement_cells(results: Results, analysis: str) -> Iterator[Cells]:
    """Yield the table row of a placement of patches: optimum and evenly spaced ones by its criterion, centers (m)."""
    if not results.has(group := f"{analysis}/placement"):
        return
    about = results.attributes(group)
    criterion, pair = about["criterion"], np.array([results[f"{group}/{which}/value"] for which in ("best", "even")])
    texts = [f"{-1e6 * value:.4g} µm" if criterion == "estimate" else f"{value:.4g}" for value in pair]
    if criterion == "voltage":
        texts = [f"{volts(value)} V" for value in results[f"{group}/largest_voltage"]]
    by = {"voltage": "voltage", "estimate": "deviation of the tip"}
    centers = [f"{x:.4g}" for x in results[f"{group}/best/centers"]]
    yield {
        "on": about["body"],
        "by": by.get(criterion, f"{about['measure']} reach"),
        "centers (m)": ",\n".join(", ".join(centers[k : k + 4]) for k in range(0, len(centers), 4)),
        "optimum": texts[0],
        "evenly spaced": texts[1],
        "sets tried": f"{about['sets']}" + (" (evolution)" if about["method"] == "evolution" else ""),
    }


def robustness_cells(results: Results, analysis: str) -> Iterator[Cells]:
    """Yield a table row for each cause: largest distance (mm) of the tip, by use of the computed inputs."""
    if not results.has(group := f"{analysis}/robustness"):
        return
    for k, cause in enumerate(results.attributes(group)["causes"]):
        lanes = sorted(results.names(group), key=lambda lane: (lane != "open_loop", lane))
        values = {lane.replace("_", " "): results[f"{group}/{lane}"][k] for lane in lanes}
        yield {"tip off by": str(cause)} | {
            lane: "" if np.isnan(of) else millimeters(of, 3) if np.isfinite(of) else "failed"
            for lane, of in values.items()
        }


def settling_cells(results: Results, analysis: str) -> Iterator[Cells]:
    """Yield a table row for each point with residual vibration after the paths."""
    for point in results.names(f"{analysis}/settling"):
        about = results.attributes(f"{analysis}/settling/{point}")
        if not vibrates(about):
            continue
        settled = about["time_to"]
        yield {
            "point": point,
            "path over\n(s)": f"{about['path_end']:.4g}",
            "off then\n(mm)": f"{1e3 * about['at_path_end']:.3g}",
            "at the end\n(mm)": f"{1e3 * about['at_end']:.3g}",
            "peak to peak\n(mm)": f"{1e3 * about['residual']:.3g}",
            "lowest\n(Hz)": "" if np.isnan(about["frequency"]) else f"{about['frequency']:.4g}",
            f"within {1e3 * about['tolerance']:g} mm\nafter (s)": "no" if np.isnan(settled) else f"{settled:.3g}",
        }


def volts(value: float) -> str:
    """Text of a voltage `value`, V, with three digits; from 1 kV on without decimals."""
    return f"{value:.0f}" if value >= 1e3 else f"{value:.3g}"


def loop_cells(results: Results, analysis: str) -> Iterator[Cells]:
    """Yield the table row of a closed loop: errors, settling, effort, saturation."""
    if not results.has(f"{analysis}/control/commands"):
        return
    about = results.attributes(f"{analysis}/control")
    yield {
        "verdict": about["verdict"].partition(" ")[0].replace("not", "stable"),  # and settling: "no"
        "rms (mm)": f"{1e3 * about['tip_error_rms']:.3g}",
        "max (mm)": f"{1e3 * about['tip_error_max']:.3g}",
        "settling\n(s)": "no" if np.isnan(about["settling_time"]) else f"{about['settling_time']:.3g}",
        "overshoot\n(mm)": f"{1e3 * about['overshoot']:.3g}",
        "vibration\n(mm)": f"{1e3 * about['vibration']:.3g}",
        "final\n(mm)": f"{1e3 * about['residual']:.3g}",
        "work\n(J)": f"{about['motor_work']:.3g}",
        "torque\n(N·m, N)": f"{about['peak_moment']:.3g}",
        "voltage\n(V)": volts(about["peak_voltage"]),
        "at\nlimits": f"{100 * about['saturated']:.2g} %",
    }
