"""What a URDF may have that no body has, and what is said of numbers, limits and followers that are odd."""

import tomllib

import numpy as np
import pytest

import ffrobot
from ffrobot import FfrobotError
from ffrobot.exchange.urdf.import_urdf import import_urdf
from ffrobot.exchange.urdf.robot import read_urdf
from ffrobot.exchange.urdf.scene import least_change

INERTIA = 'ixx="0.01" ixy="0" ixz="0" iyy="0.02" iyz="0" izz="0.025"'
TIAGO = 'ixx="0.0019" ixy="0" ixz="0" iyy="0.00846" iyz="0" izz="0.01059"'  # its first arm link, 2 % off


def link(name, inertia=INERTIA, mass="1.0"):
    return f'<link name="{name}"><inertial><mass value="{mass}"/><inertia {inertia}/></inertial></link>'


def joint(name, parent, child, kind="revolute", origin="", more='<limit lower="-3" upper="3"/>'):
    ends = f'<parent link="{parent}"/><child link="{child}"/>'
    return f'<joint name="{name}" type="{kind}">{ends}<origin {origin}/><axis xyz="0 0 1"/>{more}</joint>'


def imported(folder, *parts, **options):
    (folder / "r.urdf").write_text(f'<robot name="r">{"".join(parts)}</robot>', encoding="utf-8")
    return import_urdf(folder / "r.urdf", folder / "out", {}, **options)


def test_the_least_change():
    """It makes any inertia one of a body, and nothing else that is one is nearer: 20 000 others were tried."""
    draw = np.random.default_rng(3)
    for _ in range(10):
        Q = np.linalg.qr(draw.standard_normal((3, 3)))[0]
        J = Q @ np.diag([1.0, 2.0, 3.0 * draw.uniform(1.01, 1.6)]) @ Q.T
        fixed = least_change(J)
        low, middle, high = np.linalg.eigvalsh(fixed)
        assert high == pytest.approx(low + middle, rel=1e-14)
        steps = draw.standard_normal((2000, 3, 3)) * draw.uniform(0, 0.5, (2000, 1, 1))
        others = fixed + steps + np.swapaxes(steps, 1, 2)
        moments = np.linalg.eigvalsh(others)
        possible = others[(moments[:, 0] > 0) & (moments[:, 2] <= moments[:, 0] + moments[:, 1])]
        assert len(possible) > 100
        assert np.linalg.norm(possible - J, axis=(1, 2)).min() >= np.linalg.norm(fixed - J)
    sound = np.diag([1.0, 2.0, 2.9])
    assert least_change(sound) is sound


def test_inertias_a_little_impossible(tmp_path):
    parts = link("base"), link("arm", TIAGO, "2.0"), joint("j", "base", "arm")
    with pytest.raises(FfrobotError, match=r'link "arm".*sum of the others.*--fix-inertia makes the least change'):
        imported(tmp_path, *parts)
    found = imported(tmp_path, *parts, fix_inertia=True)
    (remark,) = (line for line in found.remarks if "moments of inertia" in line)
    excess = 0.01059 - 0.00846 - 0.0019
    assert "0.0019, 0.00846, 0.01059 kg m², which no body has, are now 0.00197667, 0.00853667, 0.0105133" in remark
    share = 100 * excess / np.sqrt(3) / np.linalg.norm([0.0019, 0.00846, 0.01059])
    assert f"changed by {share:.2g} %" in remark
    (body,) = tomllib.loads((tmp_path / "out" / "scene.toml").read_text(encoding="utf-8"))["body"]
    assert body["rigid"]["inertia"] == pytest.approx([0.0019 + excess / 3, 0.00846 + excess / 3, 0.01059 - excess / 3])
    imported(tmp_path, link("base"), link("arm"), joint("j", "base", "arm"), fix_inertia=True, force=True)


def test_negative_inertias_stay_refused(tmp_path):
    negative = 'ixx="-0.1" ixy="0" ixz="0" iyy="0.1" iyz="0" izz="0.1"'
    with pytest.raises(FfrobotError, match="moments of inertia not below 0"):
        imported(tmp_path, link("base"), link("arm", negative), joint("j", "base", "arm"), fix_inertia=True)


@pytest.mark.parametrize("inertia", ["0", "0.02"])
def test_point_masses_and_rods(inertia, tmp_path):
    """A mass of 1 kg at l = 0.5 m, of no inertia about x at least: m l² α + J α − m g l; none on the axis itself."""
    J = f'ixx="0" ixy="0" ixz="0" iyy="{inertia}" iyz="0" izz="{inertia}"'
    path = {"trajectory": [{"name": "t", "joint": "j", "value": "t**2"}]}
    path["analysis"] = [{"name": "i", "kind": "pcid", "end": 0.02, "output_step": 0.01}]
    for way in (0.5, 0.0):
        arm = link("arm", J).replace("<mass", f'<origin xyz="{way} 0 0"/><mass')
        turning = joint("j", "base", "arm").replace("0 0 1", "0 1 0" if way else "1 0 0")
        found = imported(tmp_path, link("base"), arm, turning, force=True)
        scene = ffrobot.make_scene(**found.scene, **path)
        if way:
            moment = ffrobot.solve(scene)["i/joints/j/moment"][0]
            assert moment == pytest.approx(2 * (way**2 + float(inertia)) - 9.81 * way, rel=1e-12)
        else:
            with pytest.raises(FfrobotError, match='joint "j": expected inertia about each of its axes'):
                ffrobot.solve(scene)


ENCODINGS = ["utf-8", "utf-8-sig", "utf-16", "ISO-8859-1", "windows-1251", "GB2312", "Shift_JIS"]


@pytest.mark.parametrize("encoding", ENCODINGS)
def test_encodings_that_xml_declares(tmp_path, encoding):
    name = {"ISO-8859-1": "größe", "windows-1251": "плечо"}.get(encoding, "関節" if encoding == "Shift_JIS" else "关节")
    text = f'<robot name="r">{link("base")}{link("arm")}{joint(name, "base", "arm")}</robot>'
    declared = encoding.removesuffix("-sig")
    (tmp_path / "r.urdf").write_bytes(f'<?xml version="1.0" encoding="{declared}"?>{text}'.encode(encoding))
    assert list(read_urdf(tmp_path / "r.urdf").joints) == [name]


ODD = {
    "degrees": ([joint("j", "base", "a", more='<limit lower="-180" upper="180"/>')], "-180 … 180 rad are many turns"),
    "turned in degrees": ([joint("j", "base", "a", origin='rpy="90 0 0"')], "rpy 90 0 0 is more than a turn"),
    "follows a fixed joint": (
        [link("b"), joint("j", "base", "a", "fixed"), joint("k", "a", "b", more='<mimic joint="j" offset="0.2"/>')],
        'joint "k" follows "j", which is fixed: its position is 0.2',
    ),
}


@pytest.mark.parametrize("name", ODD)
def test_remarks(name, tmp_path):
    parts, expected = ODD[name]
    found = imported(tmp_path, link("base"), link("a"), *parts)
    assert sum(expected in remark for remark in found.remarks) == 1


def test_elements_that_stand_there_twice_are_told(tmp_path):
    """The first one counts: 1 kg of both."""
    twice = link("arm").replace("</link>", '<inertial><mass value="3"/></inertial></link>')
    found = imported(tmp_path, link("base"), twice, joint("j", "base", "arm", more='<axis xyz="1 0 0"/>'))
    assert [remark for remark in found.remarks if "first counts" in remark] == [
        'link "arm": 2 <inertial>: the first counts, the others do not',
        'joint "j": 2 <axis>: the first counts, the others do not',
    ]
    assert [body["rigid"]["mass"] for body in found.scene["body"]] == [1.0]
    assert found.scene["joint"][0]["axis"] == [0.0, 0.0, 1.0]
