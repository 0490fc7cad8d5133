"""Closed loops of robots in 3D: linear models, controllers of the user, bad input."""

import numpy as np
import pytest
import scenes_in_3d
from checkpoints import CASES
from scipy.linalg import expm
from tables_3d import solved

from ffrobot.common.errors import InputError

HOLD = {"name": "hold", "kind": "pcid", "end": 0.1, "output_step": 0.0005, "tolerance": 1e-10}
GAINS = {"waist": 300.0, "shoulder": 300.0, "elbow": 80.0}
RATES = {"waist": 12.0, "shoulder": 12.0, "elbow": 3.0}
HOLDS = {"kind": "joint-pid", "proportional": GAINS, "derivative": RATES}


def arm(*analyses):
    """The case `arm_3r`, with rotors as motors have them."""
    tables = scenes_in_3d.read(CASES / "arm_3r" / "scene.toml")
    for joint in tables["joint"]:
        joint |= {"gear_ratio": 80.0, "rotor_inertia": 3e-5}
    return tables | {"analysis": list(analyses)}


def held(name, *controllers, **keys):
    of_loop = {"name": name, "kind": "closed-loop", "actuation": "hold", "sample_time": 0.001, "delay": 0.0}
    return of_loop | {"tolerance": 1e-9, "controller": list(controllers)} | keys


PUSH = (1.0, -2.0, 1.5)  # N on the tip for each N of size


def predicted(model, times, begins):
    """(K, 3) m at samples: what a push of size 1 does to the tip by the linear model, under the PD controllers."""
    joints = [f"joint/{name}" for name in GAINS]
    axes = [f"fore.tip/{axis}" for axis in "xyz"]
    B = model.B[:, model.inputs([*joints, *(f"force/{axis}" for axis in axes)])]
    (n, inputs), f = B.shape, model.freedom
    step = expm(np.block([[model.A, B], [np.zeros((inputs, n + inputs))]]) * (times[1] - times[0]))
    C, tip = model.C[model.outputs(joints)], model.C[model.outputs([f"point/{axis}" for axis in axes])]
    P, D = np.diag([*GAINS.values()]), np.diag([*RATES.values()])
    feedback = -(P @ C + D @ np.hstack([np.zeros((3, f)), C[:, :f]]))
    x, found = np.zeros(n), np.zeros((len(times), 3))
    for k, t in enumerate(times):
        found[k] = tip @ x
        force = np.array(PUSH) * (t > begins - 1e-9)
        x = step[:n, :n] @ x + step[:n, n:] @ np.concatenate([feedback @ x, force])
    return found


def test_arm_keeps_to_its_line():
    """Moments of the sagging arm are fed forward. While it moves a push displaces the tip as a model frozen there says:
    for 30 ms, in which the joints turn by 0.1 rad.
    """
    line = {"name": "hold", "kind": "fcid", "shape": "static", "end": 0.3, "output_step": 0.001, "tolerance": 1e-8}
    linear = {"name": "linear", "kind": "linear", "about": "hold", "times": [0.25]}
    keys = {"tolerance": 1e-8, "end": 0.28}
    push = {axis: f"{0.5 * part}*where(t < 0.25, 0, 1)" for axis, part in zip("xyz", PUSH, strict=True)}
    loops = [held("follows", HOLDS, **keys)]
    loops.append(held("pushed", HOLDS, disturbance=[{"point": "fore.tip"} | push], **keys))
    with solved(arm(line, linear, *loops)) as found:
        path, moved = (found[f"{name}/points/fore.tip/position"] for name in ("follows", "pushed"))
        assert np.linalg.norm(path[-1] - path[0]) > 0.3
        assert found["follows/tip_error"].max() < 2e-4
        assert found.verdict["follows"].margins.startswith("margins (linear model): gains may grow")
        (model,) = found.linear("linear")
        after = found["pushed/time"] > 0.25 - 1e-9
        expected = 0.5 * predicted(model, found["pushed/time"][after], 0.25)
        off = np.abs((moved - path)[after] - expected)
        assert off.max() < 0.05 * np.abs(expected).max()


MISTAKES = [
    ({"sensor": [{"motor": "waist"}]}, 'sensor no. 1: motor: expected a joint with stiffness .*found "waist"'),
    ({"sensor": [{"modal": "column"}]}, "expected a flexible body"),
    ({"sensor": [{"joint": "waist", "resolution": -1.0}]}, "resolution"),
    ({"controller": [{"kind": "modal-velocity", "bodies": ["fore"], "damping_ratio": 1.0}]}, "a body with patches"),
    ({"disturbance": [{"point": "fore.tip", "force": "x"}]}, "force"),
    ({"disturbance": [{"point": "fore.tip", "z": "log(t - 1)"}]}, "disturbance no. 1: z"),
    ({"actuation": "nothing"}, "actuation"),
]  # fmt: skip


@pytest.mark.parametrize(("keys", "expected"), MISTAKES)
def test_bad_keys_are_refused(keys, expected):
    with pytest.raises(InputError, match=expected):
        solved(arm(HOLD, held("loop", HOLDS) | keys))
