"""Arms with flexible links that are held straight (FCID with p = 0): the inverse dynamics of rigid robots."""

import math
import re
from pathlib import Path

import h5py
import numpy as np
import pytest
from rigid_robots import moments, with_motion

CASE = Path(__file__).parents[2] / "cases" / "arm_6r"
TUBE = """
material = {{ youngs_modulus = 70e9, poissons_ratio = 0.33, density = 2700.0 }}
geometry = {{ kind = "beam", length = {length}, section = {{ shape = "tube", outer = {outer}, inner = {inner} }} }}
mesh = {{ elements = 6 }}
reference = {{ condition = "cantilever" }}
modes = {{ count = 4, family = "all" }}
"""
TUBES = {"upper": (0.7, 0.060, 0.054), "fore": (0.6, 0.044, 0.040)}  # length, diameters in m


def inertial(name):
    """Of a slender tube along x: about axes across it as the beam has it, m L²/12."""
    length, outer, inner = TUBES[name]
    m, J_x = (2700.0 * length * math.pi * each for each in ((outer**2 - inner**2) / 4, (outer**4 - inner**4) / 32))
    J = m * length**2 / 12
    return (
        f'<inertial><origin xyz="{length / 2} 0 0"/><mass value="{m!r}"/>'
        f'<inertia ixx="{J_x!r}" ixy="0" ixz="0" iyy="{J!r}" iyz="0" izz="{J!r}"/></inertial>'
    )


def joint(name, parent, child, xyz, axis):
    ends = f'<parent link="{parent}"/><child link="{child}"/>'
    limit = '<limit lower="-3" upper="3" effort="100" velocity="5"/>'
    return f'<joint name="{name}" type="revolute">{ends}<origin xyz="{xyz}"/><axis xyz="{axis}"/>{limit}</joint>'


ARM_3R = f"""<robot name="arm_3r">
<link name="base"/>
<link name="column"><inertial><origin xyz="0 0 0.2"/><mass value="4"/>
<inertia ixx="0.06" ixy="0" ixz="0" iyy="0.06" iyz="0" izz="0.02"/></inertial></link>
<link name="upper">{inertial("upper")}</link>
<link name="fore">{inertial("fore")}</link>
{joint("waist", "base", "column", "0 0 0.1", "0 0 1")}
{joint("shoulder", "column", "upper", "0 0 0.4", "0 -1 0")}
{joint("elbow", "upper", "fore", "0.7 0 0", "0 -1 0")}
</robot>"""
ARM_6R = (CASE / "arm.urdf").read_text(encoding="utf-8")
TUBE_6R = (CASE / "links" / "tube.toml").read_text(encoding="utf-8")

# Moments at q = 0.3(1 … n), q̇ = 0.2(n … 1), q̈ = 0.5 cos(0 … n − 1) by Pinocchio 2.6.20, without friction.
EXPECTED = {
    "3r": [0.0021217853313138, 5.590245420818866, 0.1464170831262896],
    "6r": [
        0.680362372872216,
        -23.62796142979181,
        -1.070964938424388,
        -0.0493105744644358,
        2.341927292101834,
        0.00159795706122,
    ],
}


def arm(number):
    """Text of the URDF, link files of its flexible links, moving joints, and the motion."""
    if number == "3r":
        text = ARM_3R
        links = {
            name: TUBE.format(length=length, outer=outer, inner=inner) for name, (length, outer, inner) in TUBES.items()
        }
    else:
        text, links = ARM_6R, {"forearm": TUBE_6R}
    names = re.findall(r'<joint name="(\w+)" type="revolute"', text)
    n = len(names)
    rows = 0.3 * np.arange(1, n + 1), 0.2 * np.arange(n, 0, -1), 0.5 * np.cos(np.arange(n))
    return text, links, names, [dict(zip(names, map(float, row), strict=True)) for row in rows]


@pytest.fixture(scope="module", params=["3r", "6r"])
def straight(request, tmp_path_factory, ffrobot):
    """The arm, and the moments that `solve` finds for flexible links held straight."""
    text, links, names, motion = arm(request.param)
    folder = tmp_path_factory.mktemp(f"arm_{request.param}")
    urdf = folder / "arm.urdf"
    urdf.write_text(text)
    flexible = []
    for name, link in links.items():
        (folder / f"{name}.toml").write_text(link)
        flexible += ["--flexible", f"{name}={folder / name}.toml"]
    ffrobot.ok("import", urdf, "-o", folder / "out", *flexible)
    scene = folder / "out" / "scene.toml"
    keys = re.sub(r"^(viscous|coulomb)_friction = .*\n", "", scene.read_text(), flags=re.MULTILINE)
    scene.write_text(with_motion(keys, *motion).replace('\nkind = "pcid"', '\nkind = "fcid"\nshape = "zero"'))
    ffrobot.ok("solve", scene)
    with h5py.File(scene.with_suffix(".results.h5")) as file:
        found = np.array([file[f"inverse/joints/{name}/moment"][0] for name in names])
        assert set(links) <= {name for name, body in file["inverse/bodies"].items() if "modal" in body}
    return request.param, urdf, names, motion, found


def test_straight_links_move_as_rigid_ones(straight):
    number, urdf, names, motion, found = straight
    expected = np.array(EXPECTED[number])
    np.testing.assert_allclose(found, expected, atol=1e-10 * np.abs(expected).max())
    of_urdf = moments(urdf.read_text(), *motion)
    np.testing.assert_allclose(found, [of_urdf[name] for name in names], atol=1e-12 * np.abs(expected).max())
