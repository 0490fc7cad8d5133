"""What `ffrobot sensitivity`, `uncertainty` and `optimise` refuse before anything is run or written."""

import pytest
from small_robots import ARM, SWING

GOOD = "payload.0.mass=±2%"
MASS = ("--minimise", "mass")
PAYLOAD = ("--vary", "payload.0.mass=0.1:1")
OUTER = "links.arm.geometry.section.outer"
GEARED = SWING | {"joint": [SWING["joint"][0] | {"gear_ratio": 50.0}]}


@pytest.fixture
def told(refused, write):
    """The message of a command about a scene."""
    return lambda command, keys, *arguments: refused(write(keys).parent, command, "scene.toml", *arguments)


@pytest.mark.parametrize(
    ("of", "to", "message"),
    [
        ("peak", "payload.0.mass", '--of: expected "peak HISTORY"'),
        ("at noon joints.shoulder.moment", "payload.0.mass", '"at TIME HISTORY"'),
        ("mass", "payload.0.masss", '--to: expected a number at payload.0.masss, found none (did you mean "mass"?)'),
        ("mass", "payload.0.point", "--to: expected a number at payload.0.point, found 'arm.tip'"),
        ("mass", "payload.1.mass", '--to: expected one of "0" in "payload.1.mass", found "1"'),
        ("mass", "links.arm.geometry.length", "--to: expected links.BODY.KEY with a body that has a link file (none)"),
        ("mass", "payload..mass", "--to: expected a key such as payload.0.mass"),
    ],
)
def test_sensitivity(told, of, to, message):
    assert message in told("sensitivity", ARM, "--of", of, "--to", to)


@pytest.mark.parametrize(
    ("of", "spreads", "options", "message"),
    [
        ("peak of it all", [GOOD], [], '--of: expected "peak HISTORY"'),
        ("mass", ["payload.1.mass=±2%"], [], '--spread: expected one of "0" in "payload.1.mass"'),
        ("mass", ["payload.0.mass=2%"], [], "--spread: expected KEY=±2%, KEY=±0.1"),
        ("mass", ["payload.0.mass=±0"], [], "with positive spreads"),
        ("mass", ["payload.0.mass=normal:-1"], [], "with positive spreads"),
        ("mass", ["payload.0.mass=uniform:2:1"], [], "with positive spreads"),
        ("mass", ["payload.0.mass=±nan"], [], "with positive spreads"),
        ("mass", ["gravity.0=±1%"], [], "expected a spread in the unit of a key whose value is 0"),
        ("mass", [GOOD, "payload.0.mass=±1%"], [], "expected every key once, found payload.0.mass several times"),
        ("mass", ["body.arm.rigid.mass=±200%"], [], "with body.arm.rigid.mass = -2"),
        ("mass", ["body.arm.rigid.mass=normal:60%"], [], "expected spreads with which the scene makes sense"),
        ("mass", [GOOD], ["--samples", "0"], "expected at least 8 samples, found 0"),
        ("mass", [GOOD], ["--by", "gradients", "--indices"], "expected Sobol indices of samples"),
        ("", [GOOD], [], '--of: expected "peak HISTORY"'),
        ("mass", [""], [], "--spread: expected a key such as payload.0.mass"),
        ("mass", ["payload.0.mass="], [], "--spread: expected KEY=±2%, KEY=±0.1"),
    ],
)  # fmt: skip
def test_uncertainty(told, of, spreads, options, message):
    arguments = [one for text in spreads for one in ("--spread", text)]
    assert message in told("uncertainty", ARM, "--of", of, *arguments, *options)


@pytest.mark.parametrize("of", ["peak joints.shoulder.momentt", "joints.shoulder.momentt", "rms"])
def test_responses_that_are_no_numbers_are_told_after_one_run(ffrobot, write, of):
    """Which histories there are is known then."""
    scene = write(ARM)
    done = ffrobot("uncertainty", scene, "--of", of, "--spread", GOOD)
    assert done.returncode == 2
    assert 'expected the name of a history, such as "joints.' in done.stderr
    assert len(list(scene.with_suffix(".uncertainty").glob("runs/*/row.json"))) == 1


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        ((*PAYLOAD,), "expected one objective, --minimise RESPONSE or --maximise RESPONSE, found none"),
        ((*MASS, "--maximise", "mass", *PAYLOAD), "or --maximise RESPONSE, found both"),
        (("--minimise", "weight", *PAYLOAD), '--minimise: expected "peak HISTORY"'),
        ((*MASS, "--subject-to", "mass < 2", *PAYLOAD), '--subject-to: expected "RESPONSE <= NUMBER" or'),
        ((*MASS, "--subject-to", "mass <= heavy", *PAYLOAD), 'found "mass <= heavy"'),
        ((*MASS, "--subject-to", "weight <= 2", *PAYLOAD), '--subject-to: expected "peak HISTORY"'),
        ((*MASS, "--vary", "payload.0.mass"), '--vary: expected "KEY=LOW:HIGH"'),
        ((*MASS, "--vary", "payload.0.mass=1:nan"), '--vary: expected "KEY=LOW:HIGH"'),
        ((*MASS, "--vary", "payload.0.mass=1:0.1"), "--vary: expected a lower bound and a higher one"),
        ((*MASS, "--vary", "payload.0.mass=0:1:log"), "--vary: expected bounds above 0"),
        ((*MASS, "--vary", "payload.0.mass=0.6:1"), "that hold the value where the search begins, 0.5, found 0.6:1"),
        ((*MASS, "--vary", "payload.0.mass in {}"), "--vary: expected rows of 1 value"),
        ((*MASS, "--vary", "payload.0.mass,gravity.1 in {1:2, 3}"), "--vary: expected rows of 2 values"),
        ((*MASS, *PAYLOAD, *PAYLOAD), "--vary: expected every key once, found payload.0.mass several times"),
        ((*MASS, "--vary", f"{OUTER}=-0.1:0.03"), f"expected bounds that designs can have, found {OUTER} = -0.1"),
        ((*MASS, "--vary", "payload.0.mass in {1, 2}", "--method", "slsqp"), 'expected "differential-evolution" where'),
        ((*MASS, *PAYLOAD, "--method", "all"), 'expected discrete sets alone for "all"'),
        ((*MASS, "--against", "weight", *PAYLOAD), '--against: expected "peak HISTORY"'),
        ((*MASS, "--against", "mass", *PAYLOAD), '--against: expected another response than "mass"'),
        (("--maximise", "mass", "--against", "mass arm", *PAYLOAD), "--against: expected --minimise RESPONSE with it"),
        ((*MASS, "--against", "mass arm", *PAYLOAD, "--starts", 3), "--against: expected --method slsqp and one start"),
        ((*MASS, "--against", "mass arm", "--vary", "payload.0.mass in {1, 2}"), "--against: expected numbers between"),
    ],
)  # fmt: skip
def test_optimise(told, arguments, message):
    assert message in told("optimise", GEARED, *arguments)


def test_american_spellings_are_accepted(told):
    message = told("optimize", GEARED, "--minimize", "weight", *PAYLOAD)
    assert message == told("optimise", GEARED, "--minimise", "weight", *PAYLOAD)
    assert 'found "weight"' in told("optimize", GEARED, "--maximize", "weight", *PAYLOAD)
