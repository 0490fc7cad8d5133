"""Soft links in EXUDYN, as ANCF cables: a double pendulum and a four-bar linkage that fall for a second.

    pip install "exudyn==1.13.*"
    python exudyn_large_deflection.py pendulum 1e9 --elements 32 --step 2e-4 -o tip.csv

writes time and position of a point (tip of the second link, tip of the coupler) and prints the seconds that the solver
took. docs/theory.md, Subdivided links, compares. Needs no ffrobot.
"""

import argparse
import time
from itertools import pairwise

import exudyn as exu
import numpy as np
from exudyn.itemInterface import (
    LoadMassProportional,
    MarkerBodyMass,
    MarkerNodePosition,
    NodePoint2DSlope1,
    NodePointGround,
    ObjectANCFCable2D,
    RevoluteJoint2D,
    SensorNode,
)

DENSITY, WIDTH, GRAVITY = 2700.0, 0.02, 9.81


def link(mbs, start, end, elements, modulus, height):
    """A straight cable from start to end; the numbers of its first and last node."""
    area, second_moment = WIDTH * height, WIDTH * height**3 / 12
    nodes = []
    length = np.hypot(*(end - start))
    slope = (end - start) / length
    for x in np.linspace(0, 1, elements + 1):
        position = start + x * (end - start)
        nodes.append(mbs.AddNode(NodePoint2DSlope1(referenceCoordinates=[*position, *slope])))
    for pair in pairwise(nodes):
        cable = mbs.AddObject(
            ObjectANCFCable2D(
                length=length / elements,
                massPerLength=DENSITY * area,
                bendingStiffness=modulus * second_moment,
                axialStiffness=modulus * area,
                nodeNumbers=list(pair),
                useReducedOrderIntegration=1,
            )
        )
        marker = mbs.AddMarker(MarkerBodyMass(bodyNumber=cable))
        mbs.AddLoad(LoadMassProportional(markerNumber=marker, loadVector=[0, -GRAVITY, 0]))
    return nodes[0], nodes[-1]


def pin(mbs, a, b):
    """A hinge between two nodes, or a node and a place on the ground."""
    sides = [
        mbs.AddNode(NodePointGround(referenceCoordinates=[*side, 0])) if isinstance(side, np.ndarray) else side
        for side in (a, b)
    ]
    markers = [mbs.AddMarker(MarkerNodePosition(nodeNumber=side)) for side in sides]
    mbs.AddObject(RevoluteJoint2D(markerNumbers=markers))


def pendulum(mbs, elements, modulus):
    o, a, b = (np.array([x, 0.0]) for x in (0.0, 1.0, 2.0))
    first, second = (link(mbs, *ends, elements, modulus, 0.01) for ends in ((o, a), (a, b)))
    pin(mbs, o, first[0])
    pin(mbs, first[1], second[0])
    return second[1]


def four_bar(mbs, elements, modulus):
    """Crank 0.3 m at 60 degrees, coupler 0.8 m, rocker 0.6 m, on 0.7 m."""
    crank, coupler, rocker, base = 0.3, 0.8, 0.6, np.array([0.7, 0.0])
    o, a = np.zeros(2), crank * np.array([np.cos(np.pi / 3), np.sin(np.pi / 3)])
    distance = np.hypot(*(base - a))
    turn = np.arctan2(*(base - a)[::-1])
    turn += np.arccos((coupler**2 + distance**2 - rocker**2) / (2 * coupler * distance))
    b = a + coupler * np.array([np.cos(turn), np.sin(turn)])
    links = [link(mbs, *ends, elements, modulus, 0.008) for ends in ((o, a), (a, b), (b, base))]
    for one, other in ((o, links[0][0]), (links[0][1], links[1][0]), (links[1][1], links[2][0]), (links[2][1], base)):
        pin(mbs, one, other)
    return links[1][1]


def main():
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("mechanism", choices=("pendulum", "four_bar"))
    parser.add_argument("modulus", type=float, help="Young's modulus, Pa")
    parser.add_argument("--elements", type=int, default=32, help="of each link")
    parser.add_argument("--step", type=float, default=2e-4, help="s")
    parser.add_argument("-o", "--output", required=True)
    options = parser.parse_args()
    container = exu.SystemContainer()
    mbs = container.AddSystem()
    node = {"pendulum": pendulum, "four_bar": four_bar}[options.mechanism](mbs, options.elements, options.modulus)
    sensor = mbs.AddSensor(
        SensorNode(nodeNumber=node, storeInternal=True, outputVariableType=exu.OutputVariableType.Position)
    )
    mbs.Assemble()
    settings = exu.SimulationSettings()
    settings.timeIntegration.numberOfSteps = round(1 / options.step)
    settings.timeIntegration.endTime = 1.0
    settings.timeIntegration.newton.useModifiedNewton = True
    settings.timeIntegration.generalizedAlpha.spectralRadius = 0.95
    settings.solution.sensors.writePeriod = 0.01
    settings.solution.file.write = False
    settings.timeIntegration.verboseMode = 0
    began = time.perf_counter()
    mbs.SolveDynamic(settings)
    print(f"{time.perf_counter() - began:.2f} s")
    np.savetxt(options.output, mbs.GetSensorStoredData(sensor)[:, :3], delimiter=",", header="t,x,y")


if __name__ == "__main__":
    main()
