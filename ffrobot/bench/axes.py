"""Where errors come from: mesh, number of modes and time integration, each refined alone."""

from math import ceil
from typing import Any

from ..common.errors import FfrobotError
from ..fe_models.link_source import LinkTable, link_keys, link_path
from ..mbs.scene.analysis import TIGHTEST_TOLERANCE, IntegratedAnalysis
from ..run.watcher import Watcher
from ..scene.scene import Scene
from .precision import KINDS, Row, TimedRun, errors, run, with_analysis

Keys = dict[str, Any]


def _refined(scene: Scene, elements: float, modes: float) -> Scene | None:
    """The scene with `elements` and `modes` times as many of them in every link that is given by its link file.

    None where neither changes anything: no link files, or none with such keys.
    """
    changed = False
    bodies = []
    for body in scene.body:
        if body.link is not None:
            keys = link_keys(body.link)
            changed |= elements != 1 and _scale_mesh(keys, elements)
            changed |= modes != 1 and _scale_modes(keys, modes)
            body = body.model_copy(update={"link": LinkTable(keys, link_path(body.link))})
        bodies.append(body)
    update: Keys = {"body": tuple(bodies)}
    if modes != 1:  # patches that fit the modes of the scene need not fit others; where they do, nothing changes
        any_number = {"allocation": "least-squares", "mode_weights": None}
        update["pzt"] = tuple(layout.model_copy(update=any_number) for layout in scene.pzt)
    return scene.model_copy(update=update) if changed else None


def _sizes(scene: Scene) -> dict[str, str]:
    """Numbers of elements and modes in the link files: "20", or "20, 40" where they differ."""
    links = [link_keys(body.link) for body in scene.body if body.link is not None]
    meshes = (item for keys in links for item in keys.get("mesh", {}).items())
    elements = [str(value) for key, value in meshes if key not in ("cell", "order")]
    modes = [str(keys.get("modes", {}).get("count", "")) for keys in links]
    return {"elements": ", ".join(dict.fromkeys(elements)), "modes": ", ".join(dict.fromkeys(modes))}


def _scale_mesh(keys: Keys, factor: float) -> bool:
    """Whether the mesh table has what can be scaled: elements of a beam, size or divisions of a solid."""
    mesh = keys.get("mesh", {})
    if isinstance(mesh.get("elements"), int):
        mesh["elements"] = ceil(factor * mesh["elements"])
    elif "size" in mesh:
        mesh["size"] /= factor
    elif "divisions" in mesh:
        mesh["divisions"] = [ceil(factor * count) for count in mesh["divisions"]]
    else:
        return False
    return True


def _scale_modes(keys: Keys, factor: float) -> bool:
    """Whether there is a number of modes to scale, and damping that fits any number."""
    modes = keys.get("modes", {})
    if not isinstance(modes.get("count"), int) or isinstance(keys.get("damping", {}).get("ratio"), list):
        return False
    modes["count"] = ceil(factor * modes["count"])
    return True


# Times the elements and the modes of the link files; the last of each stands for the exact solution.
ELEMENTS, MODES = (0.5, 1.0, 2.0, 4.0), (0.5, 1.0, 1.5, 2.0)
UNSEEN = 0.1  # of the scene's tolerance, where time integration must not be seen


def measure_axes(scene: Scene, analysis: IntegratedAnalysis, budget: float, display: Watcher) -> list[Row]:
    """Rows of errors along each axis; runs that fail, or take longer than `budget` (s), stay as rows without errors.

    "mesh" compares with four times the elements, "modes" with twice the modes, on that mesh, "time" with a tenth of the
    tolerance (time integration alone), "total" the scene as it is with all three: at most the sum of the others. What
    the link files do not let change is left out: scenes of rigid or ready-made modal bodies have "time" alone.
    """
    tight = max(TIGHTEST_TOLERANCE, UNSEEN * analysis.tolerance)
    rows: list[Row] = []
    trial = _Trials(scene, analysis.name, budget, display)
    fine = ELEMENTS[-1] if trial(ELEMENTS[-1], 1.0, tight) else 1.0
    axes = {"mesh": [(f, 1.0) for f in ELEMENTS], "modes": [(fine, f) for f in MODES]}
    for axis, factors in axes.items():
        if best := trial(*factors[-1], tight):
            rows += [trial.row(axis, *factor, tight, best) for factor in factors[:-1]]
    rows.append(trial.row("time", 1.0, 1.0, analysis.tolerance, trial(1.0, 1.0, tight)))
    if everything := trial(fine, MODES[-1], tight):
        rows.append(trial.row("total", 1.0, 1.0, analysis.tolerance, everything))
    return rows


class _Trials:
    """Runs of one analysis with links refined; each combination once."""

    def __init__(self, scene: Scene, name: str, budget: float, display: Watcher) -> None:
        self.scene, self.name, self.budget, self.display = scene, name, budget, display
        self.done: dict[tuple[float, float, float], TimedRun] = {}

    def __call__(self, elements: float, modes: float, tolerance: float) -> TimedRun | None:
        """The run; None where the link files do not let elements or modes change."""
        key = (elements, modes, tolerance)
        if key not in self.done:
            if (scene := self._scene(elements, modes)) is None:
                return None
            self.display.stage(f"{elements:g} × elements, {modes:g} × modes, tolerance {tolerance:.0e}")
            try:
                timed = run(with_analysis(scene, self.name, tolerance=tolerance), self.name, self.budget, self.display)
            except FfrobotError as error:  # such as more modes than half the mesh has
                timed = TimedRun("", "refused", why=str(error).splitlines()[0])
            self.done[key] = timed
        return self.done[key]

    def row(self, axis: str, elements: float, modes: float, tolerance: float, best: TimedRun | None) -> Row:
        timed, scene = self(elements, modes, tolerance), self._scene(elements, modes)
        assert timed is not None
        assert scene is not None
        assert best is not None
        error = errors(timed.histories, best.histories)
        return {
            "axis": axis,
            "times": modes if axis == "modes" else elements,
            **_sizes(scene),
            "tolerance": tolerance,
            "status": timed.status,
            "against": best.status,
            "why": timed.why or best.why,
            "integrator": timed.integrator or None,
            "seconds": timed.seconds or None,
            **{f"error_{kind}": error.get(kind) for kind in KINDS},
        }

    def _scene(self, elements: float, modes: float) -> Scene | None:
        return self.scene if elements == modes == 1.0 else _refined(self.scene, elements, modes)
