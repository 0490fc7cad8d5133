"""Torques and voltages of a soft strip on ANCF cables of EXUDYN: how far its tip is off the path.

    python tests/campaigns/replay_in_exudyn.py RESULTS.h5        with EXUDYN 1.13 and h5py, in an environment of its own

The results are those of docs/howto/tracking.md with `geometric_stiffening = true`, undamped modes (six of them) and
outputs every 0.2 ms. Patches are pairs of moments at their edges. Shares no line with ffrobot.
"""

import sys
from itertools import pairwise

import exudyn as exu
import h5py
import numpy as np
from exudyn.itemInterface import (
    CoordinateConstraint,
    MarkerBodyRigid,
    MarkerNodeCoordinate,
    NodePoint2DSlope1,
    NodePointGround,
    ObjectANCFCable2D,
    SensorNode,
    Torque,
)

E, RHO, WIDTH, HEIGHT, LENGTH = 70e9, 2700.0, 0.02, 0.004, 1.0
PER_VOLT = 5.89050e-4  # N·m: 2 E_p d31 w (h + t)/2 of a pair
EDGES = [center + half for center in (0.125, 0.375, 0.625, 0.875) for half in (-0.04, 0.04)]
ELEMENTS, STEPS = 3, 3200  # between edges, and in time


def largest_error(time, torque, voltage, path, with_patches):
    """m, of y of the tip."""
    ends = [0.0, *EDGES, LENGTH]
    x = np.unique(np.concatenate([np.linspace(a, b, ELEMENTS + 1) for a, b in pairwise(ends)]))
    system = exu.SystemContainer()
    mbs, c, s = system.AddSystem(), np.cos(np.pi / 8), -np.sin(np.pi / 8)
    nodes = [mbs.AddNode(NodePoint2DSlope1(referenceCoordinates=[c * at, s * at, c, s])) for at in x]
    cables = [
        mbs.AddObject(
            ObjectANCFCable2D(
                length=h, massPerLength=RHO * WIDTH * HEIGHT, bendingStiffness=E * WIDTH * HEIGHT**3 / 12,
                axialStiffness=E * WIDTH * HEIGHT, nodeNumbers=nodes[k : k + 2], useReducedOrderIntegration=1,
            )
        )
        for k, h in enumerate(np.diff(x))
    ]  # fmt: skip
    still = mbs.AddMarker(MarkerNodeCoordinate(nodeNumber=mbs.AddNode(NodePointGround()), coordinate=0))
    for k in (0, 1):
        moving = mbs.AddMarker(MarkerNodeCoordinate(nodeNumber=nodes[0], coordinate=k))
        mbs.AddObject(CoordinateConstraint(markerNumbers=[still, moving]))

    def act(at, values):
        cable = cables[int(np.abs(x[:-1] - at).argmin())]
        marker = mbs.AddMarker(MarkerBodyRigid(bodyNumber=cable, localPosition=[0, 0, 0]))
        of_time = lambda _, t, __: [0.0, 0.0, float(np.interp(t, time, values))]  # noqa: E731
        mbs.AddLoad(Torque(markerNumber=marker, loadVector=[0, 0, 1], loadVectorUserFunction=of_time))

    act(0.0, torque)
    for k in range(voltage.shape[1] if with_patches else 0):
        for at, sign in zip(EDGES[2 * k : 2 * k + 2], (-1, 1), strict=True):
            act(at, sign * PER_VOLT * voltage[:, k])
    kind = exu.OutputVariableType.Position
    tip = mbs.AddSensor(SensorNode(nodeNumber=nodes[-1], outputVariableType=kind, storeInternal=True))
    mbs.Assemble()
    settings = exu.SimulationSettings()
    integration, newton = settings.timeIntegration, settings.timeIntegration.newton
    integration.numberOfSteps, integration.endTime, integration.adaptiveStep = STEPS, time[-1], False
    integration.generalizedAlpha.spectralRadius = 0.95
    newton.relativeTolerance, newton.absoluteTolerance, newton.useModifiedNewton = 1e-6, 1e-7, False
    settings.solutionSettings.writeSolutionToFile = False
    settings.solutionSettings.sensorsWritePeriod = time[-1] / 200
    mbs.SolveDynamic(settings)
    found = mbs.GetSensorStoredData(tip)
    return np.abs(found[:, 2] - np.interp(found[:, 0], time, path)).max()


if __name__ == "__main__":
    with h5py.File(sys.argv[1]) as file:
        run = file["carried"]
        given = [run[name][()] for name in ("time", "joints/hub/moment", "pzt/arm/voltage", "points/arm.tip/position")]
    given[3] = given[3][:, 1]
    for acts in (True, False):
        print("with patches" if acts else "torques alone", f"{1e6 * largest_error(*given, acts):.1f} µm")
