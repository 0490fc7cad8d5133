"""What the keys of scenes can say and ffrobot does not support: THE list, which pages print.

Each of these is refused by name where it is found, with what to write in its place; `where` is the module that does so.
"""

from __future__ import annotations

from typing import NamedTuple


class Unsupported(NamedTuple):
    """What there is not, what there is in its place, and the module that refuses it."""

    what: str
    instead: str
    where: str


UNSUPPORTED = (
    Unsupported(
        "`motor = true` of spherical and free joints, which have no coordinates",
        "revolute and prismatic joints in series; loads on points",
        "ffrobot.mbs.joints.joint",
    ),
    Unsupported(
        '`coupling = "surface"` of patches on ±z, of fibers and of twist: link files outline patches on ±y',
        '`coupling = "rotation"`',
        "ffrobot.actuation.patches.records",
    ),
    Unsupported(
        'compliant gears (`stiffness` of joints) with `motors = "frame"` in joints whose axis modes tilt, where they'
        " are driven, controlled or linear: no angle goes with a moment between frames there",
        '`motors = "section"`',
        "ffrobot.mbs.analysis.gears",
    ),
    Unsupported(
        "kinematic loops with a motor without `rotor_inertia`, or a compliant gear, in each joint (rotors,"
        " trajectories, friction, loads and limits of positions may be in all)",
        "a rotor in front of a rigid gear in one of them, or no motor there: ffrobot cuts the loop there",
        "ffrobot.mbs.model.model",
    ),
    Unsupported(
        "sensors and controllers on spherical and free joints, which have no coordinates, and on all joints of a"
        " kinematic loop where none has a `rotor_inertia`",
        "sensors of points, or of other joints of the loop",
        "ffrobot.actuation.control.signals",
    ),
)
