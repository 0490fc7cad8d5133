"""Least voltages of the soft strip by modes, path time and pre-actuation, and torques by modes.

    python tests/campaigns/least_voltages.py [timing] [modes] [path_time] [pre_actuation] [torques]

Prints the tables of docs/howto/tracking.md and of cases/soft_arm_tracking/README.md.
"""

from __future__ import annotations

import sys
import tempfile
from itertools import product
from pathlib import Path

import ffrobot
from ffrobot.mbs.tracking.tracking import least_voltage
from ffrobot.run.solve import prepare_scene
from ffrobot.run.watcher import Watcher

CASE = Path(__file__).parents[2] / "cases" / "soft_arm_tracking"
SEPTIC = "35*(t/0.6)**4 - 84*(t/0.6)**5 + 70*(t/0.6)**6 - 20*(t/0.6)**7"
TIMINGS = {  # derivatives up to the third, fourth and fifth begin and end at zero
    "septic": "35*s**4 - 84*s**5 + 70*s**6 - 20*s**7",
    "nonic": "126*s**5 - 420*s**6 + 540*s**7 - 315*s**8 + 70*s**9",
    "degree 11": "462*s**6 - 1980*s**7 + 3465*s**8 - 3080*s**9 + 1386*s**10 - 252*s**11",
}


def written(folder: Path, *, modes: int = 4, T: float = 0.6, timing: str = "septic", keys: str = "") -> Path:
    """The strip's scene with its first analysis alone."""
    link, scene = ((CASE / name).read_text(encoding="utf-8") for name in ("link.toml", "scene.toml"))
    scene = scene[: scene.index("# The same torques and voltages")]
    for old, new in (
        (SEPTIC, TIMINGS[timing].replace("s**", f"(t/{T})**")), ("end = 0.6", f"end = {T}"),
        ('check = "finer"\n', keys), ("output_step = 0.001", "output_step = 0.0001"),
    ):  # fmt: skip
        assert old in scene
        scene = scene.replace(old, new)
    (folder / "link.toml").write_text(link.replace("count = 4", f"count = {modes}"), encoding="utf-8")
    (folder / "scene.toml").write_text(scene, encoding="utf-8")
    return folder / "scene.toml"


def least(**changes: object) -> tuple[float, float]:
    """V, and how uncertain."""
    with tempfile.TemporaryDirectory() as folder:
        solution = prepare_scene(written(Path(folder), **changes), Watcher())  # type: ignore[arg-type]
    (analysis,) = solution.scene.analysis
    return least_voltage(solution.model, solution.patches, analysis)


def torques(**changes: object) -> tuple[float, float]:
    """Peaks of the hub, N·m, with patches and by the motor alone."""
    alone = '\n[[analysis]]\nname = "alone"\nkind = "motors-only"\nend = 0.6\noutput_step = 0.001\n'
    with tempfile.TemporaryDirectory() as folder:
        scene = written(Path(folder), **changes)  # type: ignore[arg-type]
        scene.write_text(scene.read_text(encoding="utf-8") + alone, encoding="utf-8")
        with ffrobot.solve(scene) as results:
            carried, by_motor = (results.peak(f"{name}/joints/hub/moment")[0] for name in ("carried", "alone"))
    return carried, by_motor


def main(tables: list[str]) -> None:
    """Print them."""
    for timing in TIMINGS if "timing" in tables else ():
        print(f"{timing}: {'{:.1f} V, {:.1f} V uncertain'.format(*least(timing=timing))}", flush=True)
    for modes in (2, 3, 4, 6, 8, 12, 16) if "modes" in tables else ():
        print(f"{modes:2d} modes: {'{:.1f} V, {:.1f} V uncertain'.format(*least(modes=modes))}", flush=True)
    for T in (0.45, 0.5, 0.55, 0.6, 0.7, 0.8, 1.0) if "path_time" in tables else ():
        around = "pre_actuation = 0.01\npost_actuation = 0.01\n"
        print(f"{T},{least(T=T)[0]:.1f},{least(T=T, keys=around)[0]:.1f}", flush=True)
    for ms in (0, 5, 10, 20, 30, 50) if "pre_actuation" in tables else ():
        around = f"pre_actuation = {1e-3 * ms}\npost_actuation = {1e-3 * ms}\n"
        print(f"{ms},{least(keys=around)[0]:.2f}", flush=True)
    for timing, modes in product(("septic", "nonic"), (2, 4, 8)) if "torques" in tables else ():
        peaks = "{:.4f} N·m, {:.4f} N·m by the motor alone".format(*torques(timing=timing, modes=modes))
        print(f"{timing}, {modes} modes: {peaks}", flush=True)


if __name__ == "__main__":
    main(sys.argv[1:] or ["timing", "modes", "path_time", "pre_actuation", "torques"])
