"""`ffrobot fit`: links and robots from frequencies that closed forms or other files give."""

import csv
import tomllib

import numpy as np
import pytest

import ffrobot
from ffrobot.common.errors import InputError
from ffrobot.fe_models.link import computed_modal_body
from ffrobot.fit.fitting import RobotTarget, with_values

LINK = """
name = "arm"
material = {{ youngs_modulus = {E!r}, density = {rho!r} }}  # of the data sheet
geometry = {{ kind = "beam", length = 0.6, section = {{ shape = "tube", outer = 0.02, inner = 0.016 }} }}
mesh = {{ elements = 20 }}
reference = {{ condition = "cantilever" }}
modes = {{ count = 4, family = "in-plane-bending" }}
interface = [{{ name = "tip", mass = {tip!r} }}]
"""
E, RHO = 70e9, 2700.0
AREA, I = np.pi * (0.02**2 - 0.016**2) / 4, np.pi * (0.02**4 - 0.016**4) / 64  # noqa: E741

ROBOT = """
name = "arm on a spring"
gravity = [0.0, 0.0]
body = [{ name = "arm", link = "arm.toml" }]
initial = { angles = { arm = 0.5 } }
analysis = [{ name = "linear", kind = "linear" }]

[[joint]]
name = "shoulder"
type = "revolute"
between = ["ground", "arm.root"]
gear_ratio = 100.0
rotor_inertia = 3e-5
stiffness = 500.0
"""


@pytest.fixture
def write(tmp_path):
    def link(E=E, rho=RHO, tip=0.0, name="arm"):
        path = tmp_path / f"{name}.toml"
        path.write_text(LINK.format(E=E, rho=rho, tip=tip), encoding="utf-8")
        return path

    return link


def table(path, frequencies, uncertainty=None):
    with path.open("w", newline="") as file:
        writer = csv.writer(file)
        writer.writerow(["mode", "frequency", *(["uncertainty"] if uncertainty else [])])
        for k, f in enumerate(frequencies, 1):
            writer.writerow([k, repr(float(f)), *([uncertainty * f] if uncertainty else [])])
    return path


def test_stiffness_and_density_of_a_link_with_a_known_mass(write, tmp_path):
    """A known mass at the tip tells E and ρ apart: both are found, and the new file has them, and its comment."""
    truth = computed_modal_body(write(E=66e9, rho=2900.0, tip=0.1, name="truth"))
    measured = table(tmp_path / "modes.csv", truth.frequency[:4])
    fit = ffrobot.fit_measured(write(tip=0.1), measured, ["material.youngs_modulus", "material.density"])
    np.testing.assert_allclose(fit.value, [66e9, 2900.0], rtol=1e-6)
    text = (tmp_path / "arm.fitted.toml").read_text()
    shifted = table(tmp_path / "modes.csv", truth.frequency[[0, 2, 3]])  # the second one was not found
    off = ffrobot.fit_measured(write(tip=0.1), shifted, ["material.youngs_modulus"], force=True)
    told = [any("missing in the table" in line for line in one.remarks()) for one in (fit, off)]
    assert told == [False, True]
    assert "# of the data sheet" in text
    assert tomllib.loads(text)["material"]["density"] == pytest.approx(2900.0, rel=1e-6)


def test_frequencies_of_held_and_free_motors(write, tmp_path):
    """Held, without a spring in the gear: the cantilever's. Free, without rotor: those of a pinned beam.

    β of 1 + cos β cosh β = 0, and of tan β = tanh β.
    """
    cantilever, pinned = (1.875104069, 4.694091133, 7.854757438), (3.926602312, 7.068582746, 10.210176123)
    of_cantilever, of_pinned = (
        np.square(beta) * np.sqrt(E * I / (RHO * AREA * 0.6**4)) / (2 * np.pi) for beta in (cantilever, pinned)
    )
    write()
    scene = tmp_path / "scene.toml"
    scene.write_text(ROBOT.partition("gear_ratio")[0], encoding="utf-8")
    held = RobotTarget(scene, "locked").modes({})[1]
    free = RobotTarget(scene, "free").modes({})[1]
    # twenty cubic elements: (βh)⁴/1440 = 1.7e-5 of the third frequency
    np.testing.assert_allclose(held[:3], of_cantilever, rtol=2e-5)
    # six shapes of a cantilever: those of a pinned beam lie below (Rayleigh and Ritz), the first two close
    assert np.all(free[:3] >= of_pinned)
    np.testing.assert_allclose(free[:2], of_pinned[:2], rtol=5e-4)


def test_links_of_a_scene_get_files_of_their_own(write, tmp_path):
    write()
    scene = tmp_path / "scene.toml"
    scene.write_text(ROBOT, encoding="utf-8")
    truth = RobotTarget(scene, "locked").modes({("links", "arm", "material", "youngs_modulus"): 60e9})[1]
    measured = table(tmp_path / "robot.csv", truth[:3])
    vary = ["links.arm.material.youngs_modulus"]
    fit = ffrobot.fit_measured(scene, measured, vary, motors="locked")
    assert fit.value[0] == pytest.approx(60e9, rel=1e-6)
    assert tomllib.loads((tmp_path / "scene.fitted.toml").read_text())["body"][0]["link"] == "arm.arm.fitted.toml"
    assert ffrobot.load_scene(tmp_path / "scene.fitted.toml").body[0].link == tmp_path / "arm.arm.fitted.toml"
    with pytest.raises(InputError, match="output: expected a new name, or --force to replace it"):
        ffrobot.fit_measured(scene, measured, vary, motors="locked")
    ffrobot.fit_measured(scene, measured, vary, motors="locked", force=True)
    inside, link = tmp_path / "inside.toml", LINK.format(E=E, rho=RHO, tip=0.0)  # in a table of the scene
    tables = ROBOT.replace('body = [{ name = "arm", link = "arm.toml" }]\n', "")
    inside.write_text(f'{tables}\n[[body]]\nname = "arm"\n[body.link]{link}', encoding="utf-8")
    assert ffrobot.fit_measured(inside, measured, vary, motors="locked").value[0] == pytest.approx(60e9, rel=1e-6)


def test_values_are_replaced_where_they_stand():
    text = 'a = 1.0  # first\n[b]\na = 1.0 # second\nc = { a = 1.0, d = "x" }\n'
    text += '[[e]]\nname = "n"\na = 1.0\nv = [1.0, 2.0]\n'
    changed = with_values(text, {("b", "c", "a"): 2.5, ("e", "n", "a"): 3.0, ("b", "c", "d"): 'y"#'})
    assert changed == text.replace("{ a = 1.0", "{ a = 2.5").replace('"n"\na = 1.0', '"n"\na = 3.0').replace(
        '"x"', '"y\\"#"'
    )
    assert tomllib.loads(with_values(text, {("e", "n", "v", "1"): 7.0}))["e"][0]["v"] == [1.0, 7.0]
