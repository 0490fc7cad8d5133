"""Tables of loads and limits of actuators in a results file, and motors of a catalog that suffice."""

from collections.abc import Iterator, Mapping, Sequence
from pathlib import Path
from typing import Any

import h5py
import numpy as np
from rich.console import Console, Group
from rich.table import Table

from ..actuation.motor_catalog import JointTask, MotorChoice, choices, read_catalog
from ..actuation.motors import MotorFeasibility
from ..common.errors import InputError, check_known, quoted
from ..common.libraries import scipy
from ..results.file import Results
from ..results.judging import FASTER
from .lines import plain_table, print_table


def feasibility_tables(path: Path, analysis: str | None) -> Group:
    """Return tables of loads and limits of actuators in one or all analyses. Raises `InputError` if there are none."""
    with Results(path) as results:
        judged = [name for name in results.analyses if results.has(f"{name}/feasibility")]
        if not judged:
            raise InputError(
                f"{path}: expected an analysis with motors or patches",
                "none: joints of kinematic loops have motors with motor = true alone",
            )
        if analysis is not None:
            known = f"an analysis with motors or patches, {quoted(judged)}"
            check_known(analysis, judged, f"{path}: --analysis: expected {known}")
        wanted = judged if analysis is None else [analysis]
        return Group(*(table for name in wanted for table in _tables(results, name)))


def _tables(results: Results, name: str) -> Iterator[Table | str]:
    from ..results.joints import labelled_coordinates
    from ..results.kinds import read_motors, read_unsupplied

    group, scene = results.group(name), results.scene
    yield f'analysis "{name}" ({group.attrs["kind"]})'
    units = {label: one.force_unit for label, one in labelled_coordinates(scene).items()}
    if motors := read_motors(group["feasibility"], list(units)):
        yield _motors(motors, units)
        spikes = ((name, motor.spike_in_words(units[name])) for name, motor in motors.items())
        yield from (f"motor of {name}: {text}" for name, text in spikes if text)
        if (table := _at_motors(motors, scene)).row_count:
            yield table
    if (missed := read_unsupplied(group["feasibility"])) is not None:
        yield missed.in_words
    for body, judged in group["feasibility"].get("pzt", {}).items():
        yield _patches(body, group[f"pzt/{body}"], judged)
        modes = zip(*(judged[f"mode_{key}"][()] for key in ("required", "available", "factor")), strict=True)
        rows = [(f"mode {k}", *map(_number, values)) for k, values in enumerate(modes, 1)]
        yield plain_table((body, "needs (N/√kg)", "all patches have (N/√kg)", "factor"), rows, names=1)
        yield _remedy_line(judged)
        if "current" in judged:
            yield _amplifier_line(group[f"pzt/{body}"], judged)
    yield ""


def _motors(motors: Mapping[str, MotorFeasibility], units: Mapping[str, str]) -> Table:
    """At the joint, a line for each quantity; the RMS over the run is what heats a motor."""
    lines = []
    for name, motor in motors.items():
        unit = units[name]
        force, speed = ("torque", "rad/s") if unit == "N·m" else ("force", "m/s")
        share = f"{_number(100 * motor.share_beyond)} %" if motor.share_beyond else ""
        since, can = _verdict(motor.factor, motor.saturation_time)[1:]
        can = can if motor.has_limits else "no limits"
        rows = (
            (f"{force} ({unit})", motor.moment, motor.moment_limit, _number(motor.rms_moment)),
            (f"speed ({speed})", motor.speed, motor.speed_limit, ""),
            ("power (W)", motor.power, motor.power_limit, ""),
        )
        for k, (what, peak, limit, rms) in enumerate(rows):
            ends = ("", "", "") if k else (share, since, can)
            times = "" if np.isinf(limit) else _number(peak / limit)
            lines.append(("" if k else name, what, _number(peak), _number(limit), times, rms, *ends))
    headers = (
        "motor of",
        "at the joint",
        "peak",
        "limit",
        "peak / limit",
        "RMS",
        "share above",
        "first at (s)",
        "within?",
    )
    return plain_table(headers, lines)


def _at_motors(motors: Mapping[str, MotorFeasibility], scene: Mapping[str, Any]) -> Table:
    """In front of gears, without their losses; the load's inertia is the largest, with other joints locked."""
    rows = []
    for joint in scene["joint"]:
        motor, N, J = motors.get(joint["name"]), joint.get("gear_ratio", 1.0), joint.get("rotor_inertia", 0.0)
        if motor is not None and N != 1.0:
            speed = N * motor.speed
            values = map(_number, (motor.moment / N, motor.rms_moment / N, speed))
            ratio = _number(motor.load_inertia / (J * N**2)) if J and np.isfinite(motor.load_inertia) else ""
            turns = f"{60 * speed / (2 * np.pi):.0f}"
            rows.append((joint["name"], f"{N:g}", *values, turns, _number(motor.power), ratio))
    headers = "motor of", "ratio", "peak (N·m)", "RMS (N·m)", "speed (rad/s)", "(1/min)", "power (W)"
    return plain_table((*headers, "load / rotor inertia"), rows, names=1)


def _patches(body: str, pzt: h5py.Group, judged: h5py.Group) -> Table:
    rows = []
    required, available = judged["required_moment"][()], judged["available_moment"][()]
    c, depoling = np.abs(pzt["moment_per_volt"][()]), judged.attrs["depoling_field"]
    for k in range(len(required)):
        moments = (required[k] / c[k], available[k] / c[k], required[k], available[k])
        field, strain = judged["field"][k], judged["strain"][k]
        factor, since, can = _verdict(judged["factor"][k], judged["saturation_time"][k])
        beyond = ["depoled"] if judged["limited_field"][k] > depoling else []
        beyond += ["strained"] if strain > judged.attrs["strain_limit"] else []
        cells = (f"patch {k + 1}", f"{pzt['edges'][k].mean():.4g}", *map(_number, moments), factor, since)
        of_depoling = "" if np.isinf(depoling) else _number(field / depoling)
        rows.append((*cells, _number(field / 1e6), of_depoling, _number(1e6 * strain), ", ".join([can, *beyond])))
    headers = body, "at (m)", "needs (V)", "has (V)", "needs (N·m)", "has", "factor", "from (s)", "kV/mm", "depoling"
    return plain_table((*headers, "strain (µ)", "within?"), rows, names=1)


def _remedy_line(judged: h5py.Group) -> str:
    if np.all(judged["factor"][()] <= 1.0):
        return f"voltages are within limits: at most {_number(judged['remedies'].attrs['limit'])} V"
    remedies = judged["remedies"].attrs
    if np.isinf(remedies["limit"]):
        return f"needs {FASTER}"
    count = f"{remedies['count']} patches"
    if not remedies["count"]:
        missing = _number(remedies["most_factor"])
        count = f"no number of patches ({remedies['most_count']} fit; required/available = {missing})"
    if layers := remedies["layers"]:
        count = f"{layers} layers; layers of {_number(1e3 * remedies['thickness'])} mm at the same field; {count}"
    return f"sufficient alone: a limit of {_number(remedies['limit'])} V; {count}"


def _amplifier_line(pzt: h5py.Group, judged: h5py.Group) -> str:
    """Between outputs, on the mean, of the patch that is nearest to its limit."""
    texts = [f"capacitance {_number(1e9 * pzt.attrs['capacitance'])} nF each"]
    for what, key, unit, size in (("current", "current", "mA", 1e3), ("slew rate", "slew", "V/ms", 1e-3)):
        peaks, limits = judged[key][()], judged[f"{key}_limit"][()]
        k = int(np.argmax(peaks / limits if np.isfinite(limits).any() else peaks))
        of = f" of {_number(size * limits[k])}" if np.isfinite(limits[k]) else ""
        texts.append(f"largest {what} {_number(size * peaks[k])}{of} {unit}")
    return ", ".join(texts)


def _verdict(factor: float, since: float) -> tuple[str, str, str]:
    return _number(factor), "" if np.isnan(since) else f"{since:.4g}", "yes" if factor <= 1 else "no"


def _number(value: float) -> str:
    if np.isinf(value):
        return "none"
    return f"{value:.0f}" if 1e3 <= abs(value) < 1e6 else f"{value:.3g}"


SHOWN = 3  # motors of each joint
NOTHING = 1e-9  # of what a motor can do: less is round-off
COLUMNS = ("motor of", "choice", "ratio", "RMS (N·m)", "of rated", "peak (N·m)", "of peak", "speed (rad/s)", "of max")


def print_motor_choice(path: Path, catalog: Path, analysis: str | None, console: Console) -> None:
    """Print the best motors of a catalog for each joint and analysis; the nearest one where none fits.

    Raises `InputError` for a wrong catalog, and where no analysis has motors.
    """
    motors = read_catalog(catalog)
    with Results(path) as results:
        tasks = {name: dict(joint_tasks(results, name)) for name in results.analyses}
    judged = [name for name, task in tasks.items() if task]
    if not judged or analysis is not None:
        check_known(
            analysis or "none", judged, f"{path}: --analysis: expected an analysis with motors, {quoted(judged)}"
        )
    for name in judged if analysis is None else [analysis]:
        console.out(f'analysis "{name}", motors of {catalog}')
        rows = (row for joint, task in tasks[name].items() for row in _rows(joint, choices(task, motors)))
        print_table(console, COLUMNS, rows)
    console.print("at the motor, with its own rotor; solve again with its gear_ratio and rotor_inertia to confirm")


def _rows(joint: str, rated: Sequence[MotorChoice]) -> Iterator[tuple[str, ...]]:
    fitting = [choice for choice in rated if choice.fits]
    for k, choice in enumerate(fitting[:SHOWN] or rated[:1]):
        name = choice.motor.name if choice.fits else f"none; nearest: {choice.motor.name}"
        values = (choice.rms, choice.peak, choice.speed)
        used = [value if share > NOTHING else 0.0 for value, share in zip(values, choice.shares, strict=True)]
        pairs = zip((f"{value:.3g}" for value in used), (f"{100 * x:.0f} %" for x in choice.shares), strict=True)
        yield ("" if k else joint, name, f"{choice.ratio:g}", *(cell for pair in pairs for cell in pair))


def joint_tasks(results: Results, analysis: str) -> Iterator[tuple[str, JointTask]]:
    """Yield name and load of each joint with a motor and one coordinate, without the inertia of the scene's rotor.

    Rates are of motors before compliant gears; accelerations are those of a cubic spline through them at outputs.
    Torques are scaled up to their peak between outputs.
    """
    time = results[f"{analysis}/time"]
    for joint in results.scene.get("joint", ()):
        place = f"{analysis}/joints/{joint['name']}"
        if not (results.has(f"{place}/moment") and results[f"{place}/moment"].ndim == 1) or len(time) < 4:
            continue
        side = "motor_rate" if results.has(f"{place}/motor_rate") else "rate"
        torque, rate = results[f"{place}/moment"], results[f"{place}/{side}"]
        acceleration = scipy.interpolate.CubicSpline(time, rate)(time, 1)
        rotor = joint.get("rotor_inertia", 0.0) * joint.get("gear_ratio", 1.0) ** 2
        peak = np.max(results.attributes(f"{place}/moment").get("peak", 0.0))  # between outputs too
        between = float(peak) / max(float(np.abs(torque).max()), 1e-300)
        yield joint["name"], JointTask(time, max(between, 1.0) * (torque - rotor * acceleration), rate, acceleration)
