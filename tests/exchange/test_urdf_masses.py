"""Masses of links without <inertial> from their shapes, and what a flexible link lacks of the link it replaces."""

import tomllib

import h5py
import numpy as np
import pytest
import trimesh
from rigid_robots import moments, with_motion
from test_urdf_flexible import ALONG, ARM, BAR, J_BAR, LENGTH, MASS
from test_urdf_inertias import imported, joint, link

from ffrobot import InputError
from ffrobot.exchange.urdf.shape_masses import Filling

RHO = 1500.0
AT = 'xyz="0.1 -0.2 0.3" rpy="0.4 0.5 -0.6"'


def shaped(name, *geometries, kind="collision", origin=AT):
    shapes = "".join(f"<{kind}><origin {origin}/><geometry>{each}</geometry></{kind}>" for each in geometries)
    return f'<link name="{name}">{shapes}</link>'


def body_of(found):
    (body,) = found.scene["body"]
    rigid = body["rigid"]
    inertia = np.array(rigid["inertia"])
    return rigid["mass"], np.array(rigid["center"]), np.diag(inertia) if inertia.ndim == 1 else inertia


MESHES = {
    '<box size="0.1 0.2 0.3"/>': lambda make: make.box((0.1, 0.2, 0.3)),
    '<cylinder radius="0.05" length="0.4"/>': lambda make: make.cylinder(0.05, 0.4, sections=2000),
    '<capsule radius="0.05" length="0.2"/>': lambda make: make.capsule(0.2, 0.05, count=[400, 400]),
    '<sphere radius="0.07"/>': lambda make: make.icosphere(6, 0.07),
}


@pytest.mark.parametrize(
    "shape", [pytest.param(one, marks=[pytest.mark.nightly] * one.startswith("<capsule")) for one in MESHES]
)
def test_shapes_against_their_meshes(shape, tmp_path):
    """The same shape as a fine mesh, whose volume integrals trimesh finds from its triangles."""
    parts = link("base"), joint("j", "base", "arm")
    of_shape = body_of(imported(tmp_path, *parts, shaped("arm", shape), filling=Filling(RHO)))
    name, unit = ("shape.3mf", 1e-3) if "box" in shape else ("shape.stl", 1.0)  # 3MF states that it is in mm
    MESHES[shape](trimesh.creation).apply_scale(1 / unit).export(tmp_path / name)
    mesh = shaped("arm", f'<mesh filename="{name}"/>')
    of_mesh = body_of(imported(tmp_path, *parts, mesh, filling=Filling(RHO), force=True))
    for one, other in zip(of_shape, of_mesh, strict=True):
        np.testing.assert_allclose(one, other, rtol=0, atol=5e-4 * np.abs(one).max())


@pytest.mark.parametrize("damage", ["hole", "inside out"])
def test_meshes_without_an_inside_count_with_their_hull(damage, tmp_path):
    """The integrals over a box change by a sixth of its volume for each facet of the wrong orientation."""
    box = trimesh.creation.box((0.1, 0.2, 0.3))
    if damage == "hole":
        box.update_faces(np.arange(len(box.faces)) > 0)
    else:
        box.faces[5] = box.faces[5][::-1]
    box.export(tmp_path / "shape.stl")
    found = imported(
        tmp_path, link("base"), shaped("arm", '<mesh filename="shape.stl"/>', kind="visual"), joint("j", "base", "arm"),
        filling=Filling(RHO),
    )  # fmt: skip
    assert body_of(found)[0] == pytest.approx(RHO * 0.006, rel=1e-6)
    assert any("convex hulls of meshes that are open or" in remark for remark in found.remarks)


@pytest.mark.parametrize("content", ["", "solid a\nendsolid a\n", "\0" * 84 + "half a file"])
def test_meshes_that_cannot_be_read_are_named(content, tmp_path):
    (tmp_path / "shape.stl").write_text(content)
    parts = link("base"), shaped("arm", '<mesh filename="shape.stl"/>'), joint("j", "base", "arm")
    with pytest.raises(InputError, match=r'"arm": <collision>: expected a mesh .*, found shape.stl'):
        imported(tmp_path, *parts, filling=Filling(RHO))


def test_cylinders_where_meshes_are_missing(tmp_path):
    """A slender cylinder from joint to joint: m L²/12 + m r²/4 across, m r²/2 along."""
    parts = (
        link("base"), shaped("arm", '<mesh filename="package://gone/arm.stl"/>'), link("hand"),
        joint("j", "base", "arm"), joint("k", "arm", "hand", origin='xyz="0.3 0 0.4"'),
    )  # fmt: skip
    with pytest.raises(InputError, match=r"expected its mesh next to the URDF, found no file .*--radius"):
        imported(tmp_path, *parts, filling=Filling(RHO))
    scene = imported(tmp_path, *parts, filling=Filling(RHO, 0.05)).scene
    rigid = scene["body"][0]["rigid"]
    mass = RHO * np.pi * 0.05**2 * 0.5
    assert rigid["mass"] == pytest.approx(mass, rel=1e-14)
    np.testing.assert_allclose(rigid["center"], [0.15, 0, 0.2], atol=1e-16)
    across, along = mass * (0.25 / 12 + 0.0025 / 4), mass * 0.0025 / 2
    np.testing.assert_allclose(np.linalg.eigvalsh(np.array(rigid["inertia"])), [along, across, across], rtol=1e-12)
    np.testing.assert_allclose(np.array(rigid["inertia"]) @ [0.6, 0, 0.8], np.multiply(along, [0.6, 0, 0.8]))


EXTRA = 1.3  # kg at this place in the bar's link, with an inertia of its own
MOTOR, J_MOTOR = 0.1 * ALONG + np.array([0.05, 0.02, -0.01]), np.diag([2e-3, 3e-3, 2.5e-3])
# Of the link file in the link of the URDF: x along the bar, z along the axis of the joint that carries it.
AXES = np.stack([ALONG, np.cross([1.0, 0.0, 0.0], ALONG), [1.0, 0.0, 0.0]])


def heavy_arm():
    """The arm whose upper link is the stiff bar and a motor, as one <inertial>."""
    center = (MASS * LENGTH / 2 * ALONG + EXTRA * MOTOR) / (MASS + EXTRA)
    J = J_BAR + J_MOTOR
    for mass, r in ((MASS, LENGTH / 2 * ALONG - center), (EXTRA, MOTOR - center)):
        J += mass * (r @ r * np.eye(3) - np.outer(r, r))
    entries = " ".join(f'i{"xyz"[k]}{"xyz"[j]}="{float(J[k, j])!r}"' for k in range(3) for j in range(k, 3))
    origin = " ".join(map(repr, center.tolist()))
    new = f'<inertial><origin xyz="{origin}"/><mass value="{MASS + EXTRA!r}"/><inertia {entries}/></inertial>'
    head, tail = ARM.split('<link name="upper">')
    return f'{head}<link name="upper">{new}</link>{tail.split("</link>", 1)[1]}'


def test_the_rest_of_a_flexible_link_stays_as_a_payload(tmp_path, ffrobot):
    """The payload is the motor; moments of the weights, by Newton and Euler from the URDF, are off without it."""
    text, names = heavy_arm(), ("turn", "shoulder", "elbow")
    q, rest = dict(zip(names, (0.4, -1.0, 0.7), strict=True)), dict.fromkeys(names, 0.0)
    expected, found = moments(text, q, rest, rest), {}
    (tmp_path / "arm.urdf").write_text(text)
    (tmp_path / "bar.toml").write_text(BAR)
    for out, options in (("kept", ("--keep-rest",)), ("left", ())):
        done = ffrobot.ok("import", "arm.urdf", "-o", out, "--flexible", "upper=bar.toml", *options, cwd=tmp_path)
        assert f"{MASS + EXTRA:.6g} kg" in done.stdout
        assert f"now {MASS:.6g} kg" in done.stdout
        scene = tmp_path / out / "scene.toml"
        keys = tomllib.loads(scene.read_text())
        moving = with_motion(scene.read_text(), q, rest, rest)
        scene.write_text(moving.replace("[initial.joints]", '[initial]\nstate = "static"\n[initial.joints]'))
        ffrobot.ok("solve", scene)
        with h5py.File(scene.with_suffix(".results.h5")) as file:
            found[out] = [file[f"inverse/joints/{name}/moment"][0] for name in names]
        if options:
            (payload,) = keys["payload"]
    assert payload["point"] == "upper.middle"  # 0.2 m along the bar, the nearest
    assert payload["mass"] == pytest.approx(EXTRA, rel=1e-12)
    np.testing.assert_allclose(payload["center"], AXES @ MOTOR - [0.2, 0, 0], rtol=0, atol=1e-12)
    np.testing.assert_allclose(payload["inertia"], AXES @ J_MOTOR @ AXES.T, rtol=0, atol=1e-9)
    wanted = [expected[name] for name in names]
    np.testing.assert_allclose(found["kept"], wanted, rtol=0, atol=2e-5)
    assert np.abs(np.subtract(found["left"], wanted)).max() > 0.1


def test_a_flexible_link_that_weighs_more_has_no_rest(tmp_path, refused):
    (tmp_path / "arm.urdf").write_text(ARM.replace(f'<mass value="{MASS!r}"/>', f'<mass value="{MASS / 2!r}"/>', 1))
    (tmp_path / "bar.toml").write_text(BAR)
    told = refused(tmp_path, "import", "arm.urdf", "-o", "out", "--flexible", "upper=bar.toml", "--keep-rest")
    assert "expected a link file with less mass than the URDF" in told
