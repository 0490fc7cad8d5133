"""A new kind of analysis is one file with its record, and one entry in the list of kinds."""

import subprocess
import sys
from pathlib import Path

import ffrobot.scene.kinds as kinds

TOY = '''
"""The robot turned about its first motor as it stands, without dynamics."""

from typing import Literal

import numpy as np

from ffrobot.mbs.analysis.outcome import Motion, Outcome
from ffrobot.mbs.fields.field_types import Positive
from ffrobot.mbs.fields.references import Reference
from ffrobot.mbs.scene.analysis import TimedAnalysis


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
        return Outcome(analysis=self, model=model, motion=Motion(self.times, q, v, 0 * v, nothing))
'''

SOLVE = """
import sys
import types

import numpy as np

from {name} import kinds_source
module = types.ModuleType("ffrobot.scene.kinds")
module.__package__ = "ffrobot.scene"
sys.modules["ffrobot.scene.kinds"] = module
exec(kinds_source, module.__dict__)

import ffrobot
from ffrobot.schema import schema

ROD = {{"mass": 2.0, "inertia": 0.5, "center": [0.5, 0.0], "points": {{"root": [0.0, 0.0], "tip": [1.0, 0.0]}}}}
KEYS = {{
    "name": "toy", "gravity": [0.0, 0.0], "body": [{{"name": "rod", "rigid": ROD}}],
    "joint": [{{"name": "O", "type": "revolute", "between": ["ground", "rod.root"]}}],
}}
TURN = {{"name": "turn", "kind": "turntable", "end": 1.0, "output_step": 0.25, "rate": 2.0, "body": "rod"}}


def rejected(**analysis):
    try:
        ffrobot.make_scene(**KEYS, analysis=[TURN | analysis])
    except ffrobot.InputError as error:
        return str(error)


results = ffrobot.solve(ffrobot.make_scene(**KEYS, analysis=[TURN]))
np.testing.assert_allclose(results["turn/bodies/rod/angle"], 2.0 * np.linspace(0.0, 1.0, 5))
np.testing.assert_allclose(results["turn/points/rod.tip/position"][-1], [np.cos(2.0), np.sin(2.0)])
assert dict(results.attributes("turn"))["kind"] == "turntable"

solid = ROD | {{"inertia": [0.1, 0.5, 0.5], "center": [0.5, 0.0, 0.0]}}
solid["points"] = {{"root": [0.0, 0.0, 0.0], "tip": [1.0, 0.0, 0.0]}}
in_space = KEYS | {{"space": "spatial", "gravity": [0.0, 0.0, 0.0], "body": [{{"name": "rod", "rigid": solid}}]}}
in_space["joint"] = [KEYS["joint"][0] | {{"axis": [0.0, 0.0, 1.0]}}]
turned = ffrobot.solve(ffrobot.make_scene(**in_space, analysis=[TURN]))
np.testing.assert_allclose(turned["turn/joints/O/coordinate"], 2.0 * np.linspace(0.0, 1.0, 5))
np.testing.assert_allclose(turned["turn/points/rod.tip/position"][-1], [np.cos(2.0), np.sin(2.0), 0.0], atol=1e-14)
assert "integration of turn, algebraic" in results.skipped
assert 'expected one of the bodies "rod", found "rd"' in rejected(body="rd")
assert 'expected the key "shape" only in kind = "fcid", found kind = "turntable"' in rejected(shape="zero")
assert 'expected the key "rate" in kind = "turntable", found none' in rejected(rate=None)
assert "Turntable" in schema("scene")["$defs"]
"""


def test_a_kind_is_a_file_and_an_entry(tmp_path):
    """The edit that a developer makes to the list is made here, in a process of its own."""
    source = Path(kinds.__file__).read_text(encoding="utf-8")
    entry = "AnyKind = "
    assert source.count(entry) == 1
    source = source.replace(entry, f"from turntable import Turntable\n\n{entry}Turntable | ")
    (tmp_path / "turntable.py").write_text(TOY, encoding="utf-8")
    (tmp_path / "edited.py").write_text(f"kinds_source = {source!r}\n", encoding="utf-8")
    program = SOLVE.format(name="edited")
    done = subprocess.run([sys.executable, "-c", program], cwd=tmp_path, capture_output=True, text=True, check=False)
    assert done.returncode == 0, done.stderr


def test_every_kind_says_what_it_is():
    """A record's kind is its own, and it can be run."""
    names = [kind.kind_name() for kind in kinds.KINDS]
    assert len(set(names)) == len(names) == 9
    assert all(callable(kind.run) for kind in kinds.KINDS)
