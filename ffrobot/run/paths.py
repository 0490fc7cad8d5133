"""What is found of paths before the analyses: frequencies of shapers, and the fastest motion that actuators can do."""

from __future__ import annotations

from collections.abc import Callable, Iterable
from dataclasses import replace

from ..mbs.scene.motion_keys import Shaper
from ..mbs.scene.trajectories import Trajectory
from ..mbs.solve.path_frequencies import PathFrequencies, path_frequencies
from ..scene.scene import Scene
from .fastest import Solve, fastest
from .prepare import with_scene
from .solution import Solution


def with_paths(solution: Solution, solve: Solve, stage: Callable[[str], None]) -> tuple[Solution, tuple[str, ...]]:
    """The scene with shapers for the robot's own frequencies, stretched as far as `fastest` asks for; what was found.

    `solve` runs analyses. Raises `InputError` where there are no such frequencies, or no motion keeps the limits.
    """
    solution, notes = _with_shapers(solution)
    if any(trajectory.fastest for trajectory in solution.scene.trajectory):
        stage("fastest motion")
        scene, note = fastest(solution, solve)
        solution, notes = _with_trajectories(solution, scene.trajectory), (*notes, note)
    return solution, notes


def _with_shapers(solution: Solution) -> tuple[Solution, tuple[str, ...]]:
    asking = {one.name: one.shaper for one in solution.scene.trajectory if one.shaper and one.shaper.asks_robot}
    if not asking:
        return solution, ()
    begin, end = _span(solution.scene)
    found = path_frequencies(solution.model, begin, end, max(shaper.modes for shaper in asking.values()))
    shapers = {name: _for_robot(shaper, found) for name, shaper in asking.items()}
    changed = [one.changed(shaper=shapers.get(one.name, one.shaper)) for one in solution.scene.trajectory]
    notes = tuple(f"{name}: {_in_words(shaper, found)}" for name, shaper in asking.items())
    return _with_trajectories(solution, changed), notes


def _for_robot(shaper: Shaper, found: PathFrequencies) -> Shaper:
    """The shaper for the mean frequencies and damping along the path."""
    frequency = tuple(found.frequency[:, : shaper.modes].mean(axis=0).tolist())
    damping_ratio = float(found.damping_ratio[:, : shaper.modes].mean())
    given = shaper.damping_ratio
    return Shaper(kind=shaper.kind, frequency=frequency, damping_ratio=damping_ratio if given is None else given)


def _in_words(shaper: Shaper, found: PathFrequencies) -> str:
    ranges = (f"{f.mean():.4g} Hz ({f.min():.4g} to {f.max():.4g} along the path)" for f in found.frequency.T)
    return f"{shaper.kind} shaper for {', '.join(list(ranges)[: shaper.modes])}"


def _span(scene: Scene) -> tuple[float, float]:
    """When the first path begins and the last one is over, s."""
    paths = [one.path for one in scene.trajectory]
    ends = [path.end for path in paths if path is not None]
    begins = [path.begin for path in paths if path is not None]
    return min(begins), max(ends)


def _with_trajectories(solution: Solution, trajectories: Iterable[Trajectory]) -> Solution:
    scene = solution.scene.model_copy(update={"trajectory": tuple(trajectories)})
    return replace(with_scene(solution, scene), earlier=solution.earlier)
