"""A wheel under sampled control with an encoder and an observer."""

from ffrobot.scene.load import make_scene

T, INERTIA = 0.01, 0.5
PID = {"kind": "joint-pid", "proportional": {"O": 20.0}, "derivative": {"O": 4.0}}
ENCODER = {"joint": "O", "noise": 1e-4}
GAINS = {"kind": "gains", "inputs": ["joint/O"], "outputs": ["joint/O"]}
GAINS |= {"A": [[0.5]], "B": [[1.0]], "C": [[1.0]], "gain": [[0.1]]}
KALMAN = {"kind": "kalman", "process": {"joint/O": 0.5}}


def wheel(joint=None, analysis=None, **keys):
    """A wheel about O that is to stand still, I γ̈ = u, under a closed loop."""
    body = {"mass": 1.0, "inertia": INERTIA, "center": [0.0, 0.0], "points": {"root": [0.0, 0.0], "rim": [0.3, 0.0]}}
    loop = {"name": "loop", "kind": "closed-loop", "actuation": "inverse", "sample_time": T, "tip": "w.rim"} | keys
    return make_scene(
        name="wheel", gravity=[0.0, 0.0], body=[{"name": "w", "rigid": body}],
        joint=[{"name": "O", "type": "revolute", "between": ["ground", "w.root"]} | (joint or {})],
        trajectory=[{"name": "stand", "joint": "O", "value": "0"}],
        analysis=analysis or [{"name": "inverse", "kind": "pcid", "end": 0.5, "output_step": T}, loop],
    )  # fmt: skip
