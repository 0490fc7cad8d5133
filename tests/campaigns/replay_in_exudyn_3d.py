"""Torques and voltages of a 3D rod on geometrically exact beams of EXUDYN: how far its tip is off the path.

    python tests/campaigns/replay_in_exudyn_3d.py RESULTS.h5     with EXUDYN 1.13 and h5py, in an environment of its own

The results are those of cases/arm_2r_tracking with `geometric_stiffening = true`, undamped modes (`count = 8`, four in
each plane) and `output_step = 2e-5`: time steps end at outputs. Patches are pairs of moments at their edges. The rod
begins at rest as gravity bends it. Shares no line with ffrobot.
"""

import sys
import warnings
from itertools import pairwise

import exudyn as exu
import h5py
import numpy as np
from exudyn.itemInterface import (
    GenericJoint,
    LoadMassProportional,
    MarkerBodyMass,
    MarkerBodyRigid,
    MarkerNodeRigid,
    NodeRigidBodyRotVecLG,
    ObjectBeamGeometricallyExact,
    ObjectGround,
    ObjectRigidBody,
    SensorNode,
    Torque,
)
from exudyn.rigidBodyUtilities import RotationVector2RotationMatrix

E, NU, RHO, SIDE, LENGTH, TOP = 70e9, 0.33, 2700.0, 0.006, 0.8, 0.2
PER_VOLT = 2 * 63e9 * 110e-12 * SIDE * (SIDE + 0.25e-3) / 2  # N·m: 2 E_p d31 w (h + t)/2 of a pair
EDGES = np.array([[center - 0.04, center + 0.04] for center in (0.1, 0.3, 0.5, 0.7)])
UPRIGHT, LEVEL = np.array([0.0, 0.0, 1.0]), np.array([0.0, -1.0, 0.0])  # axes of waist and shoulder, and of patches
ELEMENTS = 2  # between edges


def section():
    G, area, second = E / (2 * (1 + NU)), SIDE**2, SIDE**4 / 12
    of_beam = exu.BeamSection()
    of_beam.massPerLength, of_beam.inertia = RHO * area, RHO * second * np.diag([2.0, 1.0, 1.0])
    shear = 0.85 * G * area
    of_beam.stiffnessMatrix = np.diag([E * area, shear, shear, 0.1406 * G * SIDE**4, E * second, E * second])
    return of_beam


def rod(mbs, angle):
    """Where its nodes are (m), and their numbers."""
    x = np.unique(np.concatenate([np.linspace(a, b, ELEMENTS + 1) for a, b in pairwise([0.0, *EDGES.ravel(), LENGTH])]))
    along = np.array([np.cos(angle), 0.0, np.sin(angle)])
    nodes = [
        mbs.AddNode(NodeRigidBodyRotVecLG(referenceCoordinates=[*(TOP * UPRIGHT + s * along), *(angle * LEVEL)]))
        for s in x
    ]
    for k, length in enumerate(np.diff(x)):
        beam = ObjectBeamGeometricallyExact(nodeNumbers=nodes[k : k + 2], length=length, sectionData=section())
        marker = mbs.AddMarker(MarkerBodyMass(bodyNumber=mbs.AddObject(beam)))
        mbs.AddLoad(LoadMassProportional(markerNumber=marker, loadVector=[0, 0, -9.81]))
    return x, nodes


def column(mbs):
    """Markers of the ground, of its foot and of its top."""
    node = mbs.AddNode(NodeRigidBodyRotVecLG(referenceCoordinates=[0.0, 0.0, TOP / 2, 0.0, 0.0, 0.0]))
    body = mbs.AddObject(ObjectRigidBody(nodeNumber=node, mass=2.0, inertia=[0.01, 0.01, 0.005, 0, 0, 0]))
    ground = mbs.AddMarker(MarkerBodyRigid(bodyNumber=mbs.AddObject(ObjectGround())))
    ends = (mbs.AddMarker(MarkerBodyRigid(bodyNumber=body, localPosition=[0, 0, z])) for z in (-TOP / 2, TOP / 2))
    return ground, *ends


def settings_of(time):
    settings = exu.SimulationSettings()
    settings.solutionSettings.writeSolutionToFile = False
    settings.solutionSettings.sensorsWritePeriod = time[-1] / 200
    settings.linearSolverType = exu.LinearSolverType.EigenSparse
    settings.staticSolver.numberOfLoadSteps = 1
    settings.staticSolver.newton.relativeTolerance, settings.staticSolver.newton.absoluteTolerance = 1e-8, 1e-10
    integration, newton = settings.timeIntegration, settings.timeIntegration.newton
    integration.numberOfSteps, integration.endTime, integration.adaptiveStep = len(time) - 1, time[-1], False
    integration.generalizedAlpha.spectralRadius = 0.95
    newton.relativeTolerance, newton.absoluteTolerance, newton.useModifiedNewton = 1e-6, 1e-7, False
    return settings


def largest_error(given, with_patches):
    """m, of all components of the tip's position."""
    container, time, path = exu.SystemContainer(), given["time"], given["points/arm.tip/position"]
    mbs = container.AddSystem()
    x, nodes = rod(mbs, given["angle"])
    ground, foot, top = column(mbs)
    markers = [mbs.AddMarker(MarkerNodeRigid(nodeNumber=node)) for node in nodes]
    turned = RotationVector2RotationMatrix(given["angle"] * LEVEL)
    locked = {"constrainedAxes": [1] * 6}
    waist = mbs.AddObject(GenericJoint(markerNumbers=[ground, foot], **locked))
    shoulder = mbs.AddObject(GenericJoint(markerNumbers=[top, markers[0]], rotationMarker1=turned.T, **locked))

    def act(marker, values, axis):
        of_time = lambda _, t, __: list(np.interp(t, time, values) * axis)  # noqa: E731
        first = list(values[0] * axis)
        mbs.AddLoad(Torque(markerNumber=marker, bodyFixed=True, loadVector=first, loadVectorUserFunction=of_time))

    act(foot, given["joints/waist/moment"], UPRIGHT)
    act(top, -given["joints/shoulder/moment"], LEVEL)
    act(markers[0], given["joints/shoulder/moment"], LEVEL)
    for layout, axis in (("sideways", UPRIGHT), ("up_and_down", LEVEL)) if with_patches else ():
        for edges, voltage in zip(EDGES, given[f"pzt/{layout}/voltage"].T, strict=True):
            for edge, sign in zip(edges, (-1, 1), strict=True):
                act(markers[int(np.abs(x - edge).argmin())], sign * PER_VOLT * voltage, axis)
    kind = exu.OutputVariableType.Position
    tip = mbs.AddSensor(SensorNode(nodeNumber=nodes[-1], outputVariableType=kind, storeInternal=True))
    mbs.Assemble()
    settings = settings_of(time)
    mbs.SolveStatic(settings, updateInitialValues=True)
    mbs.SetObjectParameter(waist, "constrainedAxes", [1, 1, 1, 1, 1, 0])
    mbs.SetObjectParameter(shoulder, "constrainedAxes", [1, 1, 1, 1, 0, 1])
    mbs.SolveDynamic(settings)
    found = mbs.GetSensorStoredData(tip)
    return max(np.abs(found[:, 1 + k] - np.interp(found[:, 0], time, path[:, k])).max() for k in range(3))


def read(path):
    names = ["time", "points/arm.tip/position", "joints/waist/moment", "joints/shoulder/moment"]
    names += ["pzt/sideways/voltage", "pzt/up_and_down/voltage"]
    with h5py.File(path) as file:
        run = file["carried"]
        return {name: run[name][()] for name in names} | {"angle": float(run["joints/shoulder/coordinate"][0])}


if __name__ == "__main__":
    warnings.simplefilter("ignore", DeprecationWarning)
    given = read(sys.argv[1])
    for acts in (True, False):
        print("with patches" if acts else "torques alone", f"{1e6 * largest_error(given, acts):.1f} µm")
