"""A new kind of analysis, or type of joint, is one file with its record, and one entry in the list of them."""

import subprocess
import sys
from pathlib import Path

import ffrobot.mbs.joints.joints as joints
import ffrobot.scene.kinds as kinds
from ffrobot.exchange.urdf.export_urdf import STEPS

TOY = '''
"""The robot turned about its first motor as it stands, without dynamics."""

from typing import Literal

import numpy as np

from ffrobot.common.structs import struct
from ffrobot.mbs.run.record import Details, Run
from ffrobot.mbs.fields.field_types import Positive, Reference
from ffrobot.mbs.scene.analysis import TimedAnalysis


@struct
class Turned(Details):
    angle: float


class Turntable(TimedAnalysis):
    """Every body turns about the origin at a constant `rate` (rad/s)."""

    kind: Literal["turntable"]
    rate: Positive
    body: str

    is_algebraic = True

    def references(self):
        yield Reference("body", self.body)

    def run(self, context):
        model = context.model
        q = self.rate * self.times[:, None]
        v, nothing = np.full_like(q, self.rate), np.zeros((len(q), len(model.rows)))
        motion = {"time": self.times, "q": q, "v": v, "a": 0 * v, "multipliers": nothing}
        return Run(analysis=self, model=model, details=Turned(q[-1, 0]), **motion)
'''

EDITED = """
import sys
from importlib.util import module_from_spec, spec_from_file_location

import numpy as np

spec = spec_from_file_location("{module}", "edited.py")
sys.modules["{module}"] = module = module_from_spec(spec)
spec.loader.exec_module(module)

import ffrobot
from ffrobot.schema import schema
"""

SOLVE = """
from ffrobot.results.kinds import OF_KIND, OwnResults

ROD = {"mass": 2.0, "inertia": 0.5, "center": [0.5, 0.0], "points": {"root": [0.0, 0.0], "tip": [1.0, 0.0]}}
KEYS = {
    "name": "toy", "gravity": [0.0, 0.0], "body": [{"name": "rod", "rigid": ROD}],
    "joint": [{"name": "O", "type": "revolute", "between": ["ground", "rod.root"]}],
}
TURN = {"name": "turn", "kind": "turntable", "end": 1.0, "output_step": 0.25, "rate": 2.0, "body": "rod"}


def rejected(**analysis):
    try:
        ffrobot.make_scene(**KEYS, analysis=[TURN | analysis])
    except ffrobot.InputError as error:
        return str(error)


OF_KIND["turntable"] = OwnResults(
    "turned",
    write=lambda group, run, details: group.create_group("turned").attrs.update(angle=details.angle),
    answer=lambda about: f"turned: by {about['angle']:g} rad",
)
results = ffrobot.solve(ffrobot.make_scene(**KEYS, analysis=[TURN]))
np.testing.assert_allclose(results["turn/bodies/rod/angle"], 2.0 * np.linspace(0.0, 1.0, 5))
np.testing.assert_allclose(results["turn/points/rod.tip/position"][-1], [np.cos(2.0), np.sin(2.0)])
assert dict(results.attributes("turn"))["kind"] == "turntable"
verdict = results.verdict.analyses[0]
assert (verdict.answer, verdict.in_short) == ("turned: by 2 rad", "turned")

solid = ROD | {"inertia": [0.1, 0.5, 0.5], "center": [0.5, 0.0, 0.0]}
solid["points"] = {"root": [0.0, 0.0, 0.0], "tip": [1.0, 0.0, 0.0]}
in_3d = KEYS | {"space": "spatial", "gravity": [0.0, 0.0, 0.0], "body": [{"name": "rod", "rigid": solid}]}
in_3d["joint"] = [KEYS["joint"][0] | {"axis": [0.0, 0.0, 1.0]}]
turned = ffrobot.solve(ffrobot.make_scene(**in_3d, analysis=[TURN]))
np.testing.assert_allclose(turned["turn/joints/O/coordinate"], 2.0 * np.linspace(0.0, 1.0, 5))
np.testing.assert_allclose(turned["turn/points/rod.tip/position"][-1], [np.cos(2.0), np.sin(2.0), 0.0], atol=1e-14)
assert "integration of turn, algebraic" in results.skipped
assert 'expected one of the bodies "rod", found "rd"' in rejected(body="rd")
assert 'expected the key "shape" only in kind = "fcid", found kind = "turntable"' in rejected(shape="zero")
assert 'expected the key "rate" in kind = "turntable", found none' in rejected(rate=None)
assert "Turntable" in schema("scene")["$defs"]
"""


SLOT = '''
"""A pin in a slot of another body."""

from typing import Annotated, ClassVar, Literal

from ffrobot.common.keys import Vector2, Vector3
from ffrobot.mbs.fields.spelling import Spelled, place
from ffrobot.mbs.joints.joint import Along, AxialJoint, LoopEquation


class SlotJoint(AxialJoint):
    """The second point slides along `axis` of the first side, m, and turns freely there."""

    type: Literal["slot"]
    axis: Annotated[Vector3, Spelled(Vector2, place)]
    """Direction of the slot in the axes of the first of `between`, of any length."""

    units = ("m",)
    loop_equations = (LoopEquation("slide", 0), LoopEquation("slide", 1))
    along = (Along("slide", 2),)
    locates: ClassVar[bool] = False  # it leaves a place open: loops are cut here
'''

QUICK_RETURN = """
r, d, w = 0.3, 0.5, 2.0  # crank, way between the pins on the ground, rate of the crank


def rod(n, length):
    inertia = {2: 0.1, 3: [0.01, 0.1, 0.1]}[n]
    points = {"root": [0.0] * n, "tip": [length] + [0.0] * (n - 1)}
    return {"mass": 2.0, "inertia": inertia, "center": [length / 2] + [0.0] * (n - 1), "points": points}


def mechanism(n):
    axis = {"axis": [0.0, 0.0, 1.0]} if n == 3 else {}
    along = [1.0] + [0.0] * (n - 1)
    slot = {"name": "S", "type": "slot", "between": ["arm.root", "crank.tip"], "axis": along}
    return ffrobot.make_scene(
        name="quick return", space={2: "planar", 3: "spatial"}[n], gravity=[0.0] * n,
        body=[{"name": "crank", "rigid": rod(n, r)}, {"name": "arm", "rigid": rod(n, 1.0)}],
        joint=[
            {"name": "O", "type": "revolute", "between": ["ground", "crank.root"], "motor": True} | axis,
            {"name": "A", "type": "revolute", "between": ["ground", "arm.root"], "at": [0.0, -d, 0.0][:n]} | axis,
            slot,
        ],
        initial={"joints": {"O": 0.2, "A": 1.0}},
        trajectory=[{"name": "turn", "joint": "O", "value": f"0.2+{w}*t"}],
        analysis=[{"name": "inverse", "kind": "pcid", "end": 2.0, "output_step": 0.1, "tolerance": 1e-9}],
    )


for n in (2, 3):
    results = ffrobot.solve(mechanism(n))
    crank = 0.2 + w * results["inverse/time"]
    x, y = r * np.cos(crank), r * np.sin(crank) + d
    np.testing.assert_allclose(results["inverse/joints/A/coordinate"], np.arctan2(y, x), atol=1e-8)
    np.testing.assert_allclose(results["inverse/joints/S/coordinate"], np.hypot(x, y), atol=1e-8)
    # Power of the crank's motor is that of the arm, J φ' φ'': nothing else speeds up.
    N, D = r * w * (x * np.cos(crank) + y * np.sin(crank)), x**2 + y**2
    rate = N / D
    acceleration = (w**2 * d * x - rate * 2 * r * w * (y * np.cos(crank) - x * np.sin(crank))) / D
    power = (0.1 + 2.0 * 0.5**2) * rate * acceleration
    np.testing.assert_allclose(results["inverse/joints/O/moment"] * w, power, atol=1e-7 * np.abs(power).max())

assert {"SlotJoint", "SlotJointInPlane"} <= set(schema("scene")["$defs"])
"""


def solved_with(entry, module, own, program, folder):
    """In a process of its own, with the edit that a developer makes to the list in `module`."""
    source = Path(module.__file__).read_text(encoding="utf-8")
    before, after = entry
    assert source.count(before) == 1
    source = source.replace(before, after)
    name, content = own
    (folder / f"{name}.py").write_text(content, encoding="utf-8")
    (folder / "edited.py").write_text(source, encoding="utf-8")
    text = EDITED.format(module=module.__name__) + program
    done = subprocess.run([sys.executable, "-c", text], cwd=folder, capture_output=True, text=True, check=False)
    assert done.returncode == 0, done.stderr


def test_a_kind_is_a_file_and_an_entry(tmp_path):
    entry = '        "pcid"', '        "turntable": "turntable:Turntable",\n        "pcid"'
    solved_with(entry, kinds, ("turntable", TOY), SOLVE, tmp_path)


def test_urdfs_have_joints_for_every_type():
    assert set(STEPS) == set(joints.JOINT_TYPES), "STEPS in ffrobot/exchange/urdf/export_urdf.py"


def test_a_type_of_joint_is_a_file_and_an_entry(tmp_path):
    entry = "    RevoluteJoint\n", "    RevoluteJoint\n    | __import__('slot').SlotJoint\n"
    solved_with(entry, joints, ("slot", SLOT), QUICK_RETURN, tmp_path)
