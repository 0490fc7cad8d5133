"""The measured piezo cantilever: predictions against the records."""

import importlib.util
import re
import tomllib

import numpy as np
import pytest
from checkpoints import CASES

import ffrobot

CASE = CASES / "piezo_beam_measured"


@pytest.fixture(scope="module")
def printed():
    """What the comparison prints: predicted and measured values by the name of the line, in order."""
    specification = importlib.util.spec_from_file_location("compare_measured_beam", CASE / "compare.py")
    compare = importlib.util.module_from_spec(specification)
    specification.loader.exec_module(compare)
    lines = []
    compare.print = lambda text: lines.append(text)
    compare.draw = lambda *_: None
    compare.main()
    return numbers(lines)


def numbers(lines):
    """(name, predicted, measured) of each line of the table."""
    found = (re.fullmatch(r"(.*?)\s{2,}(-?[\d.e-]+)\s+(-?[\d.e-]+)\s+[+-][\d.]+ %.*", line) for line in lines)
    return [(match[1].strip(), float(match[2]), float(match[3])) for match in found if match]


def test_the_readme_has_these_numbers(printed):
    """One sample of the record, 10 ms, is 0.8 % of a settling time."""
    written = numbers((CASE / "README.md").read_text(encoding="utf-8").splitlines())
    assert [name for name, *_ in written] == [name for name, *_ in printed]
    for (name, *values), (_, *found) in zip(written, printed, strict=True):
        assert found == pytest.approx(values, rel=0.01), name


def test_designed_gains_settle_sooner_and_have_a_margin():
    """Keys and numbers of the README, against 1.26 s and 1.07-fold of the published gains."""
    text = (CASE / "README.md").read_text(encoding="utf-8")
    scene = tomllib.loads((CASE / "scene.toml").read_text(encoding="utf-8"))
    still = next(one for one in scene["analysis"] if one["name"] == "still")
    scene["analysis"] = [still, *tomllib.loads(re.search(r"```toml\n(.*?)```", text, re.DOTALL)[1])["analysis"]]
    results = ffrobot.solve(ffrobot.make_scene(folder=CASE, **scene))
    y = results["designed/points/beam.tip/position"][:, 1]
    end = results.time("designed")[np.flatnonzero(np.abs(y) > 0.5e-3)[-1]] - 0.12
    margin = results.attributes("designed/control")["gain_margin"]
    written = re.search(r"settle within 0.5 mm after ([\d.]+) s, and may grow ([\d.]+)-fold", text)
    assert [end, margin] == pytest.approx([float(written[1]), float(written[2])], rel=0.01)
    assert end < 1.26
