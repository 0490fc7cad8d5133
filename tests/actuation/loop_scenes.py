"""Scenes under sampled control: a wheel, with an encoder and observers too, two rods, gears that give."""

from dataclasses import replace

from ffrobot.actuation.context import ActuatedContext
from ffrobot.mbs.posture.path_start import path_start
from ffrobot.run.solve import prepare_scene
from ffrobot.scene.load import make_scene

INERTIA, T = 0.5, 0.01
ROD = {"mass": 2.0, "inertia": 2.0 / 12, "center": [0.5, 0.0], "points": {"root": [0.0, 0.0], "tip": [1.0, 0.0]}}
ARM = {"O": {"joint": "O", "value": "0.4+0.9*sin(2*t)"}, "A": {"joint": "A", "value": "-1.1+0.7*cos(3*t)"}}
PID = {"kind": "joint-pid", "proportional": {"O": 20.0}, "derivative": {"O": 4.0}}
ENCODER = {"joint": "O", "noise": 1e-4}
KALMAN = {"kind": "kalman", "process": {"joint/O": 0.5}}
GAINS = {"kind": "gains", "inputs": ["joint/O"], "outputs": ["joint/O"]}
GAINS |= {"A": [[0.5]], "B": [[1.0]], "C": [[1.0]], "gain": [[0.1]]}


def loop(name="loop", **keys):
    return {"name": name, "kind": "closed-loop", "actuation": "inverse", "sample_time": T} | keys


def wheel(*analyses, joint=None, target="0", bodies=(), joints=(), gravity=(0.0, 0.0), **keys):
    """A wheel about O that is to stand still, or to follow `target`: I γ̈ = u, the simplest plant."""
    body = {"mass": 1.0, "inertia": INERTIA, "center": [0.0, 0.0], "points": {"root": [0.0, 0.0], "rim": [0.3, 0.0]}}
    revolute = {"name": "O", "type": "revolute", "between": ["ground", "w.root"]} | (joint or {})
    step = keys.pop("step", T)
    inverse = {"name": "inverse", "kind": "pcid", "end": 0.5, "output_step": step, "tolerance": 1e-9}
    return make_scene(
        name="wheel", gravity=gravity, body=[{"name": "w", "rigid": body}, *bodies], joint=[revolute, *joints],
        trajectory=[{"name": "stand", "joint": "O", "value": target}], analysis=[inverse, *analyses], **keys,
    )  # fmt: skip


def observed(**keys):
    """The wheel in a loop with a tip."""
    return wheel(loop(tip="w.rim", **keys))


def blow(force=5.0, until=0.1):
    return [{"point": "w.rim", "y": f"where(t <= {until}, {force}, 0)"}]


def two_rods(*analyses, **keys):
    joints = [
        {"name": "O", "type": "revolute", "between": ["ground", "a.root"]} | keys.pop("first", {}),
        {"name": "A", "type": "revolute", "between": ["a.tip", "b.root"]} | keys.pop("second", {}),
    ]
    inverse = {"name": "inverse", "kind": "pcid", "end": 1.0, "output_step": 0.01, "tolerance": 1e-8}
    return make_scene(
        name="rods", gravity=[0.0, -9.81], body=[{"name": "a", "rigid": ROD}, {"name": "b", "rigid": ROD}],
        joint=joints, trajectory=[{"name": name} | path for name, path in keys.pop("paths", ARM).items()],
        initial={"angles": {"a": 0.4, "b": 0.0}}, analysis=[inverse, *analyses], **keys,
    )  # fmt: skip


GIVES = {"gear_ratio": 50.0, "rotor_inertia": 1e-4, "stiffness": 2e3, "damping": 1.0}
ON_MOTORS = {"kind": "joint-pid", "side": "motor", "proportional": {"O": 200.0}, "derivative": {"O": 10.0}}


def moving_at(rates, scene):
    """The closed loop of a wheel's scene about an inverse analysis that is to have found these rates (T,)."""
    model, (inverse, analysis) = prepare_scene(scene).model, scene.analysis
    context = ActuatedContext(
        model=model, outcomes={}, progress=lambda _: True, path=path_start(model, inverse.last_time), is_replayed=True
    )
    source = inverse.run(context)
    source = replace(source, v=rates(source.v), look_closer=None)
    return analysis.run(replace(context, outcomes={"inverse": source}))
