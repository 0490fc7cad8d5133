"""THE list of kinds of analysis. A new kind is one file with its record and what it runs, and one entry here."""

from typing import Annotated

from ..common.deferred import Deferred
from ..mbs.scene.analysis import Analysis

KINDS = Deferred(
    "kind",
    {
        "pcid": "ffrobot.mbs.analysis.pcid:Pcid",
        "fcid": "ffrobot.mbs.analysis.fcid:Fcid",
        "forward": "ffrobot.mbs.analysis.forward:Forward",
        "static": "ffrobot.mbs.analysis.operating_points:Static",
        "linear": "ffrobot.actuation.control.linear:Linear",
        "placement": "ffrobot.actuation.control.placement:PatchPlacement",
        "motors-only": "ffrobot.mbs.inversion.motors_only:MotorsOnly",
        "tracking": "ffrobot.mbs.tracking.tracking:Tracking",
        "closed-loop": "ffrobot.actuation.control.closed_loop:ClosedLoop",
    },
)
"""Where the record of each kind is: its module is imported when a scene has such an analysis."""

AnyKind = Annotated[Analysis, KINDS]
"""One table [[analysis]] of a scene, of the kind that it says."""
