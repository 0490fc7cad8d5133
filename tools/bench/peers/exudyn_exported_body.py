"""A body that `ffrobot export --format exudyn` wrote, in EXUDYN, beside the same scene here: docs/benchmarks.md.

    pip install "exudyn==1.13.*"
    python exudyn_exported_body.py -o FOLDER            # both cases; a table, the runs as CSV files

An arm on a hinge along n = (1, 2, 2)/3, undeformed and at rest at first, undamped. "slew": without gravity, the hinge
turns by π/2 (t − sin 2πt / 2π) in 1 s. "fall": gravity −z, the hinge is free. What is compared is the deflection of the
tip in axes of the body every 0.01 s: the largest difference over the largest deflection.

EXUDYN's gravity on this object leaves the deformation out of the moment on the frame (`native`); a user function adds
it (`full`): M = (A S̄ p) × g about the frame's origin, 2 Eᵀ M on the Euler parameters.
"""

import argparse
import csv
import subprocess
import sys
from pathlib import Path

import exudyn as exu
import numpy as np
from exudyn.FEM import ObjectFFRFreducedOrderInterface
from exudyn.itemInterface import CoordinateConstraint, MarkerNodeCoordinate, NodePointGround, SensorNode

from ffrobot import Results

AXIS = np.array([1.0, 2.0, 2.0]) / 3
GRAVITY = np.array([0.0, 0.0, -9.81])
END = {"slew": 1.0, "fall": 0.1}
OUTPUT_STEP = 1e-2
STEPS = {"slew": (8e-5, 4e-5, 2e-5), "fall": (8e-6, 4e-6, 2e-6)}

LINK = """
name = "arm"
material = { youngs_modulus = 70e9, poissons_ratio = 0.33, density = 2700.0 }
geometry = { kind = "beam", length = 0.6, section = { shape = "tube", outer = 0.02, inner = 0.016 } }
mesh = { elements = 20 }
reference = { condition = "cantilever" }
modes = { count = 6, attachment_modes = false }
damping = { ratio = 0.0 }
"""
SCENE = """
name = "slew"
space = "spatial"
gravity = [0.0, 0.0, 0.0]
body = [{ name = "arm", link = "arm.toml" }]
joint = [{ name = "hinge", type = "revolute", between = ["ground", "arm.root"], axis = [1.0, 2.0, 2.0] }]
"""
MOTION = """
trajectory = [{ name = "turn", joint = "hinge", value = "pi/2*(t - sin(2*pi*t)/(2*pi))" }]
analysis = [{ name = "run", kind = "pcid", end = 1.0, output_step = 0.01, tolerance = 1e-10 }]
"""
FREE = 'analysis = [{ name = "run", kind = "forward", end = 0.1, output_step = 0.01, tolerance = 1e-10 }]\n'
OURS = {"slew": SCENE + MOTION, "fall": SCENE.replace("0.0, 0.0, 0.0]", "0.0, 0.0, -9.81]", 1) + FREE}


def here(folder):
    """The exported body, the number of its tip's node, and tip deflections (T, 3) of both cases from this program."""
    (folder / "arm.toml").write_text(LINK)
    found = {}
    for name, text in OURS.items():
        (folder / f"{name}.toml").write_text(text)
        ffrobot("solve", folder / f"{name}.toml")
        found[name] = Results(folder / f"{name}.results.h5")["run/points/arm.tip/deflection"]
    ffrobot("link", folder / "arm.toml", "-o", folder / "arm.h5")
    told = ffrobot("export", folder / "arm.h5", "--format", "exudyn")
    node = int(told.split("numbers of nodes, from 0: ")[1].split("tip = ")[1].split()[0].rstrip(","))
    return folder / "arm.exudyn.npz", node, found


def ffrobot(*arguments):
    done = subprocess.run([sys.executable, "-m", "ffrobot", *map(str, arguments)], capture_output=True, text=True)
    if done.returncode:
        raise SystemExit(done.stderr)
    return done.stdout


def hold(mbs, node, coordinate, **functions):
    """Hold a coordinate of the node, or let it follow."""
    ground = mbs.AddMarker(MarkerNodeCoordinate(nodeNumber=mbs.AddNode(NodePointGround()), coordinate=0))
    held = mbs.AddMarker(MarkerNodeCoordinate(nodeNumber=node, coordinate=coordinate))
    mbs.AddObject(CoordinateConstraint(markerNumbers=[ground, held], **functions))


def turn(mbs, node):
    """Let the Euler parameters e1, e2, e3 = n sin(φ/2) follow; e0 comes from their norm.

    With Rxyz angles as coordinates of the node the deflection came out off by up to 45 % of its peak (EXUDYN 1.13.6),
    with Euler parameters it converges to ours.
    """
    w = 2 * np.pi
    for n, coordinate in zip(AXIS, (4, 5, 6), strict=True):
        hold(
            mbs, node, coordinate,
            offsetUserFunction=lambda mbs, t, item, offset, n=n: float(
                n * np.sin(np.pi / 4 * (t - np.sin(w * t) / w))
            ),
            offsetUserFunction_t=lambda mbs, t, item, offset, n=n: float(
                n * np.cos(np.pi / 4 * (t - np.sin(w * t) / w)) * np.pi / 4 * (1 - np.cos(w * t))
            ),
        )  # fmt: skip


def hinge(mbs, node):
    """e1 : e2 : e3 = 1 : 2 : 2."""
    e1, e2, e3 = (mbs.AddMarker(MarkerNodeCoordinate(nodeNumber=node, coordinate=k)) for k in (4, 5, 6))
    mbs.AddObject(CoordinateConstraint(markerNumbers=[e2, e1], factor1=2.0))
    mbs.AddObject(CoordinateConstraint(markerNumbers=[e2, e3]))


def moment_of_sagging(S_bar):
    """User function: what gravity on the deformation does to the Euler parameters."""

    def force(mbs, t, item, q, q_t):
        e0, *e = 1.0 + q[3], *q[4:7]
        tilde = np.array([[0, -e[2], e[1]], [e[2], 0, -e[0]], [-e[1], e[0], 0]])
        A = np.eye(3) + 2 * e0 * tilde + 2 * tilde @ tilde
        E = np.column_stack([-np.array(e), e0 * np.eye(3) + tilde])  # ω = 2 E ė, global axes
        generalized = np.zeros(len(q))
        generalized[3:7] = 2 * E.T @ np.cross(A @ S_bar @ q[7:], GRAVITY)
        return generalized

    return force


def build(path, case, *, full):
    """The system, the body's interface, and the sensor of its modal coordinates."""
    body = ObjectFFRFreducedOrderInterface()
    body.LoadFromFile(str(path))
    mbs = exu.SystemContainer().AddSystem()
    items = body.AddObjectFFRFreducedOrder(mbs, gravity=list(GRAVITY) if case == "fall" else [0, 0, 0])
    for place in (0, 1, 2):
        hold(mbs, items["nRigidBody"], place)
    (turn if case == "slew" else hinge)(mbs, items["nRigidBody"])
    if full:
        mbs.SetObjectParameter(items["oFFRFreducedOrder"], "forceUserFunction", moment_of_sagging(body.mPhitTPsi))
    sensor = mbs.AddSensor(
        SensorNode(
            nodeNumber=items["nGenericODE2"], outputVariableType=exu.OutputVariableType.Coordinates,
            storeInternal=True, writeToFile=False,
        )
    )  # fmt: skip
    mbs.Assemble()
    return mbs, body, sensor


def run(path, node, case, step, *, full):
    """Deflection (T, 3) of the node, at this step of generalized-alpha without numerical damping."""
    mbs, body, sensor = build(path, case, full=full)
    settings = exu.SimulationSettings()
    settings.timeIntegration.numberOfSteps = round(END[case] / step)
    settings.timeIntegration.endTime = END[case]
    settings.timeIntegration.verboseMode = 0
    settings.timeIntegration.generalizedAlpha.spectralRadius = 1.0
    settings.timeIntegration.generalizedAlpha.useIndex2Constraints = True
    settings.timeIntegration.generalizedAlpha.useNewmark = True
    settings.solution.file.write = False
    settings.solution.sensors.writePeriod = OUTPUT_STEP
    mbs.SolveDynamic(settings)
    modal = mbs.GetSensorStoredData(sensor)[:, 1:]
    return modal @ body.modeBasis[3 * node : 3 * node + 3].T


def main():
    parser = argparse.ArgumentParser(description=__doc__.split("\n", maxsplit=1)[0])
    parser.add_argument("-o", "--output", type=Path, required=True)
    folder = parser.parse_args().output
    folder.mkdir(exist_ok=True)
    path, node, ours = here(folder)
    rows = [("case", "gravity", "step", "largest difference over largest deflection")]
    for case, steps in STEPS.items():
        for full in (False, True) if case == "fall" else (False,):
            for step in steps:
                found = run(path, node, case, step, full=full)
                gravity = "none" if case == "slew" else "full" if full else "native"
                np.savetxt(folder / f"{case}_{gravity}_{step:g}.csv", found, delimiter=",", fmt="%.17g")
                error = np.abs(found - ours[case]).max() / np.abs(ours[case]).max()
                rows.append((case, gravity, f"{step:g}", f"{error:.2e}"))
                print(*rows[-1], flush=True)
    with (folder / "table.csv").open("w", newline="", encoding="utf-8") as file:
        csv.writer(file).writerows(rows)


if __name__ == "__main__":
    main()
