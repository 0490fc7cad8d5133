"""The paper's two-link case in EXUDYN, from our modal body files: inverse dynamics with the path as a constraint.

    pip install "exudyn==1.13.*" h5py
    python exudyn_two_link.py link1.h5 link2.h5 --step 1e-4 -o run.csv

writes time, force on the tip (N) and its deflection (m), and prints one line of JSON: seconds, versions, settings.
`python -m bench --peer` runs it and compares. Needs no ffrobot: modal body files are self-contained.

Links are ObjectFFRFreducedOrder; its invariants are ours in other clothes (`reduced_order`). They move in 3D there,
held to the plane by coordinate constraints. The tip is joined to a point without mass that follows the path.

Two things EXUDYN does otherwise. Its gravity leaves the deformation out of the moment on the frame: `--gravity full`
adds it by a user function, `--gravity native` does not. Its initial accelerations leave out C_tt, the acceleration of
the path, so that forces start wrong; there is no setting for that.
"""

import argparse
import json
import platform
import sys
import time

import h5py
import numpy as np

sys.exudynFast = True  # without range checks
import exudyn as exu  # noqa: E402
from exudyn.itemInterface import (  # noqa: E402
    CoordinateConstraint,
    LoadMassProportional,
    MarkerBodyMass,
    MarkerBodyPosition,
    MarkerNodeCoordinate,
    MarkerNodePosition,
    MarkerSuperElementPosition,
    NodeGenericODE2,
    NodePoint,
    NodePointGround,
    NodeRigidBodyRxyz,
    ObjectFFRFreducedOrder,
    ObjectGround,
    ObjectMassPoint,
    SensorNode,
    SensorObject,
    SphericalJoint,
)

GRAVITY = np.array([0.0, -9.81, 0.0])
END, OUTPUT_STEP = 1.0, 1e-3
START = (0.0, np.pi / 3)  # angles of the frames
TIP = np.array([1.5, np.sqrt(3) / 2])
LEVI_CIVITA = np.zeros((3, 3, 3))
LEVI_CIVITA[[0, 1, 2], [1, 2, 0], [2, 0, 1]] = 1.0
LEVI_CIVITA[[0, 2, 1], [2, 1, 0], [1, 0, 2]] = -1.0


def reduced_order(file):
    """Arguments of ObjectFFRFreducedOrder (Zwölfer and Gerstmayr, Acta Mech. 231, 2020) from a modal body file.

    There ã is the matrix of the cross product with a, and a mode l has the three columns 3l … 3l + 2 in what carries a
    tilde on Ψ: ∫ρ ãᵀb = −∫ρ a×b, ∫ρ ãᵀb̃ = ∫ρ (a·b I − b aᵀ). Nodes are our interfaces root and tip.
    """
    mass, s0, J2 = file["mass"][()], file["first_moment"][()], file["second_moment"][()]
    S_bar, I_bar, S_bar_kl = (file[f"invariants/{name}"][()] for name in ("S_bar", "I_bar", "S_bar_kl"))
    n, e = S_bar.shape[1], LEVI_CIVITA
    one = np.eye(3)
    psi_psi = np.einsum("ij,kklm->limj", one, S_bar_kl) - np.einsum("jilm->limj", S_bar_kl)
    x_psi = np.einsum("ij,kkl->ilj", one, I_bar) - np.einsum("jil->ilj", I_bar)
    ends = [file[f"interfaces/{name}"] for name in ("root", "tip")]
    container = {}
    for key, matrix in (("stiffness", file["modes/stiffness"][()]), ("mass", file["modes/mass"][()])):
        container[key] = exu.MatrixContainer()
        container[key].SetWithDenseMatrix(matrix, useDenseMatrix=False)
    return {
        "mass": float(mass),
        "inertia": np.trace(J2) * one - J2,
        "centerOfMass": s0 / mass,
        "massMatrixReduced": container["mass"],
        "stiffnessMatrixReduced": container["stiffness"],
        "modeBasis": np.vstack([end["translation"][()] for end in ends]),
        "referencePositions": np.concatenate([end["position"][()] for end in ends]),
        "mPhitTPsi": S_bar,
        "mPhitTPsiTilde": -np.einsum("ijk,kl->ilj", e, S_bar).reshape(3, 3 * n),
        "mPsiTildePsi": -np.einsum("ijk,jklm->lim", e, S_bar_kl).reshape(3 * n, n),
        "mPsiTildePsiTilde": psi_psi.reshape(3 * n, 3 * n),
        "mXRefTildePsi": -np.einsum("ijk,jkl->il", e, I_bar),
        "mXRefTildePsiTilde": x_psi.reshape(3, 3 * n),
    }


def moment_of_sagging(S_bar, angle0):
    """User function: the part of gravity's moment on the frame that deformation adds, (A_θ S̄ p)·g about z."""

    def force(mbs, t, item, q, q_t):
        theta = angle0 + q[5]
        c, s = np.cos(theta), np.sin(theta)
        x, y = S_bar[:2] @ q[6:]
        generalized = np.zeros(len(q))
        generalized[5] = (c * x - s * y) * GRAVITY[1] - (s * x + c * y) * GRAVITY[0]
        return generalized

    return force


def add_link(mbs, file, position, angle, full_gravity, ground):
    """A link held to the plane; returns its object, its modal node and markers at root and tip."""
    terms = reduced_order(file)
    n = terms["modeBasis"].shape[1]
    frame = mbs.AddNode(NodeRigidBodyRxyz(referenceCoordinates=[*position, 0, 0, angle]))
    modal = mbs.AddNode(
        NodeGenericODE2(
            numberOfODE2Coordinates=n,
            referenceCoordinates=[0] * n,
            initialCoordinates=[0] * n,
            initialCoordinates_t=[0] * n,
        )
    )
    sagging = moment_of_sagging(terms["mPhitTPsi"], angle) if full_gravity else 0
    link = mbs.AddObject(
        ObjectFFRFreducedOrder(nodeNumbers=[frame, modal], computeFFRFterms=True, forceUserFunction=sagging, **terms)
    )
    mbs.AddLoad(
        LoadMassProportional(markerNumber=mbs.AddMarker(MarkerBodyMass(bodyNumber=link)), loadVector=list(GRAVITY))
    )
    for coordinate in (2, 3, 4):
        held = mbs.AddMarker(MarkerNodeCoordinate(nodeNumber=frame, coordinate=coordinate))
        mbs.AddObject(CoordinateConstraint(markerNumbers=[ground, held]))
    ends = [
        mbs.AddMarker(MarkerSuperElementPosition(bodyNumber=link, meshNodeNumbers=[k], weightingFactors=[1.0]))
        for k in (0, 1)
    ]
    return modal, *ends


def add_path(mbs, ground):
    """A point without mass that follows the path; returns its marker."""
    point = mbs.AddNode(NodePoint(referenceCoordinates=[*TIP, 0]))
    mbs.AddObject(ObjectMassPoint(mass=0.0, nodeNumber=point))
    w = np.pi / 4
    for k in (0, 1, 2):
        size = float(TIP[k]) if k < 2 else 0.0
        functions = {}
        if k < 2:
            functions = {
                "offsetUserFunction": lambda mbs, t, item, offset, size=size: size * (np.cos(w * t) - 1),
                "offsetUserFunction_t": lambda mbs, t, item, offset, size=size: -size * w * np.sin(w * t),
            }
        driven = mbs.AddMarker(MarkerNodeCoordinate(nodeNumber=point, coordinate=k))
        mbs.AddObject(CoordinateConstraint(markerNumbers=[ground, driven], **functions))
    return mbs.AddMarker(MarkerNodePosition(nodeNumber=point))


def build(files, full_gravity):
    """The mechanism; returns the system and its sensors of tip force and modal coordinates of link 2."""
    mbs = exu.SystemContainer().AddSystem()
    base = mbs.AddObject(ObjectGround())
    ground = mbs.AddMarker(MarkerNodeCoordinate(nodeNumber=mbs.AddNode(NodePointGround()), coordinate=0))
    elbow = [np.cos(START[0]), np.sin(START[0]), 0.0]
    _, root1, tip1 = add_link(mbs, files[0], [0.0, 0.0, 0.0], START[0], full_gravity, ground)
    modal2, root2, tip2 = add_link(mbs, files[1], elbow, START[1], full_gravity, ground)
    shoulder = mbs.AddMarker(MarkerBodyPosition(bodyNumber=base))
    planar = {"constrainedAxes": [1, 1, 0]}
    mbs.AddObject(SphericalJoint(markerNumbers=[shoulder, root1], **planar))
    mbs.AddObject(SphericalJoint(markerNumbers=[tip1, root2], **planar))
    drive = mbs.AddObject(SphericalJoint(markerNumbers=[add_path(mbs, ground), tip2], **planar))
    kept = {"storeInternal": True, "writeToFile": False}
    force = mbs.AddSensor(SensorObject(objectNumber=drive, outputVariableType=exu.OutputVariableType.Force, **kept))
    p = mbs.AddSensor(SensorNode(nodeNumber=modal2, outputVariableType=exu.OutputVariableType.Coordinates, **kept))
    mbs.Assemble()
    return mbs, force, p


def settings_for(arguments):
    """Generalized-alpha in steps of equal size, EXUDYN's own way of integrating such systems."""
    settings = exu.SimulationSettings()
    settings.timeIntegration.numberOfSteps = round(END / arguments.step)
    settings.timeIntegration.endTime = END
    settings.timeIntegration.verboseMode = 0
    settings.timeIntegration.generalizedAlpha.spectralRadius = arguments.spectral_radius
    settings.timeIntegration.generalizedAlpha.useIndex2Constraints = arguments.index == 2
    settings.timeIntegration.generalizedAlpha.useNewmark = arguments.index == 2
    settings.timeIntegration.generalizedAlpha.computeInitialAccelerations = True
    settings.solution.file.write = False
    settings.solution.sensors.writePeriod = OUTPUT_STEP
    return settings


def main():
    parser = argparse.ArgumentParser(description=__doc__.split("\n", maxsplit=1)[0])
    parser.add_argument("link", nargs=2)
    parser.add_argument("--step", type=float, default=1e-4)
    parser.add_argument("--gravity", choices=["full", "native"], default="full")
    parser.add_argument("--index", type=int, choices=[2, 3], default=3)
    parser.add_argument("--spectral-radius", type=float, default=0.9)
    parser.add_argument("-o", "--output", required=True)
    arguments = parser.parse_args()
    with h5py.File(arguments.link[0]) as link1, h5py.File(arguments.link[1]) as link2:
        mbs, force, p = build((link1, link2), arguments.gravity == "full")
        tip = link2["interfaces/tip/translation"][()]
    settings = settings_for(arguments)
    began = time.perf_counter()
    completed = bool(mbs.SolveDynamic(settings))
    seconds = time.perf_counter() - began
    forces, modal = mbs.GetSensorStoredData(force), mbs.GetSensorStoredData(p)
    time_and_force = forces[:, :3] * [1, -1, -1]  # the sensor's is that of the tip on the point
    columns = [time_and_force, modal[:, 1:] @ tip[:2].T]
    header = "time,force_x,force_y,deflection_x,deflection_y"
    np.savetxt(arguments.output, np.column_stack(columns), delimiter=",", header=header, comments="")
    about = {"exudyn": exu.config.Version(), "python": platform.python_version(), "numpy": np.__version__}
    print(json.dumps({"seconds": seconds, "completed": completed, **about}))


if __name__ == "__main__":
    main()
