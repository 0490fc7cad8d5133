"""What a linear analysis or a placement refers to, checked before anything is computed."""

from __future__ import annotations

from collections.abc import Iterator, Sequence

from ...common.validation import did_you_mean, quoted
from .analysis_records import STATIC, Analysis
from .scene import SceneKeys


def linear_problems(scene: SceneKeys, analysis: Analysis, earlier: Sequence[Analysis]) -> Iterator[str]:
    """What is wrong with one, a line each."""
    if analysis.kind == "linear" and not scene.motor_joints and not scene.pzt:
        yield 'kind: expected motors or [[pzt]] for "linear", found neither: nothing to control the robot with'
    if analysis.placement is not None:
        yield from _placement_problems(scene, analysis, earlier)
    if analysis.source is None:
        if analysis.instants is not None:
            yield f'times: expected none about "{STATIC}", found {quoted(f"{t:g}" for t in analysis.instants)}'
        return
    sources = {other.name: other for other in earlier if other.kind not in ("linear", "placement")}
    source = sources.get(analysis.source)
    if source is None:
        known, hint = quoted((STATIC, *sources)), did_you_mean(analysis.source, sources)
        yield f'about: expected an earlier analysis of a motion, {known}, found "{analysis.source}"{hint}'
        return
    over_path = analysis.placement is not None and analysis.placement.criterion == "voltage"
    if analysis.instants is None and not over_path:
        yield f'times: expected the times of "{source.name}" about which to be linear, found none'
    for t in analysis.instants or ():
        if t > source.end:
            yield f'times: expected at most {source.end:g}, where "{source.name}" ends, found {t:g}'


def _placement_problems(scene: SceneKeys, analysis: Analysis, earlier: Sequence[Analysis]) -> Iterator[str]:
    assert analysis.placement is not None
    wanted, layouts = analysis.placement, [layout.body for layout in scene.pzt]
    if wanted.body not in layouts:
        yield f'placement.body: expected a body with patches, {quoted(layouts)}, found "{wanted.body}"'
    if wanted.criterion != "voltage":
        if analysis.instants is not None and len(analysis.instants) != 1:
            yield f"times: expected one time to place patches for, found {len(analysis.instants)}"
        return
    source = next((other for other in earlier if other.name == analysis.source), None)
    if source is None or source.kind not in ("pcid", "fcid"):
        found = "none" if source is None else f'"{source.name}" of kind "{source.kind}"'
        yield (
            'about: expected an earlier analysis of kind "pcid" or "fcid" for placement.criterion = "voltage", found'
            f" {found}"
        )
