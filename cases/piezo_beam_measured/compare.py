"""Predictions of the measured piezo cantilever against the records: a table, and two figures.

    .venv/bin/python cases/piezo_beam_measured/compare.py

The first decay sets the damping; nothing else is fitted. The hand that holds the tip is a force, chosen so that the tip
is where the record has it. Under control, curves begin at the first crossing of zero after the release.
"""

import tomllib
from pathlib import Path

import matplotlib as mpl
import numpy as np

import ffrobot
from ffrobot import Results

mpl.use("Agg")
from matplotlib import pyplot as plt

HERE = Path(__file__).parent
FREQUENCY, GAIN = 8.206, -1.894e-3  # Hz, fitted to the first 2 s of decay 1; mm/V, of the model identified there
RELEASE = {1: 1.66, 2: 1.31}  # s, of the records under control: last samples in which the tip is held
HOLD, STEP = 0.12, 0.01  # s, of the scene: until the release; of samples
SHARE, SETTLED, SHOWN = 0.3, 0.5, 1.2  # of the amplitude; mm; s


def record(name: str) -> np.ndarray:
    """Time (s) and tip (mm) of a record, under control also the voltage (V): (2 or 3, T)."""
    return np.loadtxt(HERE / "measured" / f"{name}.csv", delimiter=",", skiprows=1).T


def scene_held_at(position: float) -> Results:
    """The run under control with the tip held at `position` (mm) before the release."""
    scene = tomllib.loads((HERE / "scene.toml").read_text())
    force = -1.49 * position / -12.628  # N, which the statics of scene.toml make proportional to the position
    scene["load"][0]["y"] = f"where(t < {HOLD}, {force}, 0)"
    scene["analysis"] = [one for one in scene["analysis"] if one["name"] in ("still", "controlled")]
    return ffrobot.solve(ffrobot.make_scene(folder=HERE, **scene))


def tip(results: Results, analysis: str) -> tuple[np.ndarray, np.ndarray]:
    """Time after the release (s) and position of the tip (mm)."""
    return results.time(analysis) - HOLD, 1e3 * results[f"{analysis}/points/beam.tip/position"][:, 1]


def peaks(t: np.ndarray, y: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Times and absolute values of the peaks after the release, by parabolas through three samples."""
    a, b, c = np.abs(y[:-2]), np.abs(y[1:-1]), np.abs(y[2:])
    top = (b >= a) & (b > c) & (t[1:-1] > 0.0)
    a, b, c = a[top], b[top], c[top]
    shift = 0.5 * (a - c) / (a - 2.0 * b + c)
    return t[1:-1][top] + shift * STEP, b - 0.25 * (a - c) * shift


def decay_time(t: np.ndarray, y: np.ndarray) -> float:
    """Time in which the amplitude falls to `SHARE` of that of the first peak (s)."""
    at, size = peaks(t, y)
    return float(at[np.flatnonzero(size >= SHARE * size[0])[-1]] - at[0])


def settling(t: np.ndarray, y: np.ndarray) -> tuple[float, int]:
    """Time after the release until the tip stays within `SETTLED` (s), and the oscillations until then."""
    end = float(t[np.flatnonzero(np.abs(y) > SETTLED)[-1]])
    crossings = np.count_nonzero((y[:-1] * y[1:] < 0.0) & (t[1:] > 0.0) & (t[1:] <= end))
    return end, round(crossings / 2)


def from_crossing(t: np.ndarray, y: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """The curve with its time from the first crossing of zero after the release."""
    k = int(np.flatnonzero((t[1:] > 0.0) & (y[:-1] * y[1:] <= 0.0))[0])
    return t - (t[k] - y[k] * STEP / (y[k + 1] - y[k])), y


def rms_difference(measured: tuple[np.ndarray, np.ndarray], computed: tuple[np.ndarray, np.ndarray]) -> float:
    """Of two curves over `SHOWN` (mm)."""
    t, y = measured
    shown = (t >= 0.0) & (t <= SHOWN)
    return float(np.sqrt(np.mean((np.interp(t[shown], *computed) - y[shown]) ** 2)))


def line(what: str, predicted: float, measured: float, unit: str) -> None:
    """One line of the table."""
    print(f"{what:44} {predicted:10.4g} {measured:10.4g} {100 * (predicted / measured - 1):+8.1f} %   {unit}")


def draw(name: str, title: str, curves: dict[str, tuple[np.ndarray, np.ndarray]], end: float) -> None:
    """The curves over each other."""
    figure, axes = plt.subplots(figsize=(7, 3), layout="constrained")
    for (label, (t, y)), style in zip(curves.items(), ("k.", "-"), strict=True):
        axes.plot(t, y, style, label=label, markersize=3, linewidth=1)
    axes.set(xlim=(-0.1, end), xlabel="time (s)", ylabel="tip (mm)", title=title)
    axes.legend(loc="upper right")
    (HERE / "figures").mkdir(exist_ok=True)
    figure.savefig(HERE / "figures" / f"{name}.png", dpi=120)


def main() -> None:
    """Print the table and draw the figures."""
    results = ffrobot.solve(HERE / "scene.toml")
    model = results.linear("linear")[0]
    gain = -(model.C @ np.linalg.solve(model.A, model.B))[1, :2].sum()
    free = tip(results, "decay")
    decays = {k: record(f"free_decay_{k}") for k in (1, 2, 3, 4)}
    print(f"{'':44} {'predicted':>10} {'measured':>10} {'error':>10}")
    line("lowest frequency", float(results["linear/linear/frequency"][0, 0]), FREQUENCY, "Hz")
    line("static gain of P1 and P2", 1e3 * gain, GAIN, "mm/V")
    for k, one in decays.items():
        line(f"decay {k} to 30 %{' (sets the damping)' * (k == 1)}", decay_time(*free), decay_time(*one), "s")
    runs = {}
    for k, release in RELEASE.items():
        t, y, _ = record(f"closed_loop_{k}")
        held = float(y[(t > release - 0.1) & (t <= release)].mean())
        measured, computed = (t - release, y), tip(scene_held_at(held), "controlled")
        ends = [settling(*one) for one in (computed, measured)]
        print(f"control {k}, released at {held:.1f} mm")
        line("  settled within 0.5 mm", ends[0][0], ends[1][0], "s")
        line("  oscillations until then", ends[0][1], ends[1][1], "")
        runs[k] = {"measured": from_crossing(*measured), "predicted": from_crossing(*computed)}
        print(f"  RMS of the difference over {SHOWN} s: {rms_difference(*runs[k].values()):.2f} mm")
    draw("controlled", "Released at 12.6 mm, with the published controller", runs[1], 1.5)
    scale = peaks(*decays[1])[1][0] / peaks(*free)[1][0]
    started = {"measured": from_crossing(*decays[1]), "computed": from_crossing(free[0], scale * free[1])}
    draw("decay", "Free decay 1, which sets the damping", started, 6.0)


if __name__ == "__main__":
    main()
