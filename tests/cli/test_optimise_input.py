"""What `ffrobot optimise` refuses before anything is run or written."""

import pytest

SCENE = """
name = "arm"
gravity = [0.0, -9.81]
payload = [{ point = "arm.tip", mass = 0.5 }]
joint = [{ name = "shoulder", type = "revolute", between = ["ground", "arm.root"], gear_ratio = 50.0 }]
trajectory = [{ name = "swing", joint = "shoulder", value = "t**2" }]
analysis = [{ name = "inverse", kind = "pcid", end = 0.5, output_step = 0.05 }]

[[body]]
name = "arm"
link = { name = "arm", material = { youngs_modulus = 70e9, density = 2700.0, poissons_ratio = 0.3 }, geometry = { kind = "beam", length = 0.6, section = { shape = "tube", outer = 0.02, inner = 0.016 } }, mesh = { elements = 2 }, reference = { condition = "cantilever" } }
"""  # noqa: E501

MASS = ("--minimise", "mass")
PAYLOAD = ("--vary", "payload.0.mass=0.1:1")
OUTER = "links.arm.geometry.section.outer"


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
        ((*MASS, "--vary", "payload.0.mas=0.1:1"), '--vary: expected a number at payload.0.mas, found none (did you'),
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
def test_mistakes_are_told_before_any_run(refused, tmp_path, arguments, message):
    (tmp_path / "scene.toml").write_text(SCENE, encoding="utf-8")
    assert message in refused(tmp_path, "optimise", "scene.toml", *arguments)


def test_american_spellings_are_accepted(refused, tmp_path):
    (tmp_path / "scene.toml").write_text(SCENE, encoding="utf-8")
    message = refused(tmp_path, "optimize", "scene.toml", "--minimize", "weight", *PAYLOAD)
    assert message == refused(tmp_path, "optimise", "scene.toml", "--minimise", "weight", *PAYLOAD)
    assert 'found "weight"' in refused(tmp_path, "optimize", "scene.toml", "--maximize", "weight", *PAYLOAD)
