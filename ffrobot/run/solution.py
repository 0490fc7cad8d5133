"""What a solve of a scene computed: the scene as it is prepared, and the results of each analysis."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import field
from typing import TYPE_CHECKING

from ..common.structs import struct
from ..mbs.run.record import Run
from .prepared import Prepared
from .result import AnalysisResult

if TYPE_CHECKING:  # most scenes have none of these
    from .mode_search import ModeChoice


@struct
class Solution(Prepared):
    """Everything a solve of a scene in space computed.

    Attributes:
        analyses: by name, in the order of the scene.
        seconds: wall time by stage.
        failure: what ended the run after these analyses; None where all ran, or the last of them did not complete.
        unread: the run of the analysis of which outputs failed; its integration is kept.
        path_notes: what was found of paths before the analyses, one line each.
        earlier: runs of analyses to go on with, from a results file: see `results.resume`.
        mode_choice: where `modes = "auto"`.
    """

    analyses: Mapping[str, AnalysisResult] = field(default_factory=dict)
    seconds: Mapping[str, float] = field(default_factory=dict)
    failure: Exception | None = None
    unread: Run | None = None
    path_notes: tuple[str, ...] = ()
    earlier: Mapping[str, Run] = field(default_factory=dict)
    mode_choice: ModeChoice | None = None

    @property
    def outcomes(self) -> dict[str, Run]:
        """Runs by the name of their analysis."""
        runs = [*(result.run for result in self.analyses.values()), *([self.unread] if self.unread else [])]
        return {run.analysis.name: run for run in runs}

    def goes_on(self, outcome: Run) -> bool:
        """Whether `outcome` is of use to `resume`; a search for modes or pieces has its own bodies and starts again."""
        searched = any("auto" in (body.modes, body.pieces) for body in self.scene.body)
        return not searched and outcome.analysis.is_resumable
