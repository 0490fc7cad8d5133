"""THE list of kinds of analysis. A new kind is one file with its record and what it runs, and one entry here."""

from __future__ import annotations

from typing import Annotated, get_args

from pydantic import Field

from ..actuation.control.closed_loop import ClosedLoop
from ..actuation.control.linear import Linear
from ..actuation.control.placement import PatchPlacement
from ..mbs.analysis.fcid import Fcid
from ..mbs.analysis.forward import Forward
from ..mbs.analysis.motors_only import MotorsOnly
from ..mbs.analysis.pcid import Pcid
from ..mbs.analysis.static import Static
from ..mbs.analysis.tracking import Tracking

AnyKind = Pcid | Fcid | Forward | Static | Linear | PatchPlacement | MotorsOnly | Tracking | ClosedLoop

Analysis = Annotated[AnyKind, Field(discriminator="kind")]
"""One table [[analysis]] of a scene, of the kind that it says."""

KINDS: tuple[type[AnyKind], ...] = get_args(AnyKind)
