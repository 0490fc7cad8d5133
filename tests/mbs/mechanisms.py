"""Scenes written in Python, with bodies that are given as `PlanarBody`."""

from pathlib import Path

import numpy as np
from oracle import Mechanism

from ffrobot.mbs import _core
from ffrobot.mbs.analysis.forward import Forward
from ffrobot.mbs.analysis.pcid import Pcid
from ffrobot.mbs.model.model import build_model
from ffrobot.mbs.model.planar_tree import PlanarTree
from ffrobot.mbs.model.system import MechanismSystem
from ffrobot.scene.load import make_scene
from ffrobot.scene.scene import Scene

PLACEHOLDER = {"mass": 1.0, "inertia": 1.0, "center": (0.0, 0.0)}  # the bodies themselves are passed beside the scene


def make_model(bodies, modal_loads=(), **keys):
    """A model of `bodies`; `keys` are those of a scene file."""
    tables = {"gravity": (0.0, -9.81)} | keys
    if "analysis" not in tables:
        tables["analysis"] = (pcid(),)
    for name in ("joint", "trajectory", "load"):
        tables[name] = tuple(tables.get(name, ()))
    scene = Scene(
        name="test",
        body=tuple({"name": body.name, "rigid": PLACEHOLDER} for body in bodies),
        path=Path("scene.toml"),
        text="",
        **tables,
    )
    return build_model(scene, bodies, modal_loads)


def checked_scene(joints, bodies=("a",)):
    """The scene of rigid bodies with these joints, checked as one in a file is."""
    rigid = PLACEHOLDER | {"points": {"root": (0.0, 0.0), "tip": (1.0, 0.0)}}
    return make_scene(
        name="test",
        gravity=(0.0, -9.81),
        body=[{"name": name, "rigid": rigid} for name in bodies],
        joint=joints,
        analysis=[{"name": "rest", "kind": "static"}],
    )


def pcid(name="inverse", end=1.0, output_step=0.01, **keys):
    return Pcid(name=name, kind="pcid", end=end, output_step=output_step, **keys)


def forward(name="forward", end=1.0, output_step=0.01, **keys):
    return Forward(name=name, kind="forward", end=end, output_step=output_step, **keys)


def revolute(name, first, second, **keys):
    return {"name": name, "type": "revolute", "between": (first, second), **keys}


def assemble(model):
    """All joints, trajectories, loads and motors of the model in one system."""
    return MechanismSystem(model, [*model.joints, *model.trajectories], model.loads, list(model.motors.values()))


def random_state(rng, size, modal=0.1):
    """Any q and v: positions and angles of order one, `modal` times as much in all of q."""
    return modal * rng.standard_normal(size) + 0.5, rng.standard_normal(size)


def always(_):
    """The progress of runs that nobody watches."""
    return True


def core_run(assembly, q, v, times, tolerance=1e-6, max_steps=0, motors=(), **keys):
    """A run of the core itself from (q, v) of the system, with DOP853; forces of `motors` (measures) are found."""
    controls = _core.IntegrationControls(
        tolerance=tolerance, max_steps=max_steps, methods=[(_core.MethodKind.dop853, 1.0, 0.0)], spectral_radius=0.8
    )
    tree = PlanarTree(assembly, motors)
    q, v = tree.state(q, v)
    return _core.run_tree(tree.both, times=times, q=q, v=v, controls=controls, carry_on=always, **keys)


def evaluate(assembly, t, q, v):
    """Accelerations and multipliers by the core, of a state that the joints of the tree allow."""
    return PlanarTree(assembly).evaluate(t, q, v)


def energies(assembly, q, v):
    """Kinetic, strain, gravitational energy and dissipated power by the core, of such a state."""
    tree = PlanarTree(assembly)
    return tree.both.energies(*(x[None] for x in tree.state(q, v)))[0]


def joint_state(rng, assembly, modal=0.1):
    """Any q and v that the joints of the tree allow; what is held by rows may be violated."""
    tree = PlanarTree(assembly)
    found = tree.both.at(0.0, *random_state(rng, tree.core.n_v, modal))
    return found.q[0], found.v[0]


def relative(got, expected, scale=None):
    """Largest difference relative to the largest expected value."""
    return np.abs(got - expected).max() / (np.abs(expected).max() if scale is None else scale)


def oracle_of(assembly):
    """The oracle's mechanism with the same bodies and rows, in the same order."""
    model = assembly.model
    return Mechanism(
        model.bodies,
        model.scene.gravity,
        [(constraint.measure, constraint.target) for constraint in assembly.constraints],
        assembly.drives,
        [(load.body, load.vector, load.magnitude) for load in model.modal_loads],
        model.rotors,
        model.frictions,
        [(gear.motor, gear.coordinate, gear.stiffness, gear.damping) for gear in model.gears],
        model.state_forces,
    )


def on_constraints(assembly, t, q, v):
    """(q, v) moved onto the constraints by least steps, as the oracle has these."""
    oracle = oracle_of(assembly)
    for _ in range(20):
        C, _, C_q = oracle.constraint_values(t, q, v)
        if np.abs(C).max(initial=0.0) < 1e-15:
            break
        q = q - np.linalg.lstsq(C_q, C, rcond=None)[0]
    _, rate, C_q = oracle.constraint_values(t, q, v)
    return q, v - np.linalg.lstsq(C_q, rate, rcond=None)[0]
