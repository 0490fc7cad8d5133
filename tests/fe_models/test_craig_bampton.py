"""Craig–Bampton: closed forms of its matrices, identities, stresses, and what is refused."""

import sys
from pathlib import Path

import h5py
import numpy as np
import pytest
from beam_links import beam_link, flexibility, link_keys, rectangle
from scipy.linalg import eigh

import ffrobot
from ffrobot.common.errors import InputError
from ffrobot.fe_models.link import restated
from ffrobot.fe_models.link_file import read_link
from ffrobot.fe_models.link_source import LinkTable
from ffrobot.fe_models.modal_body.craig_bampton import craig_bampton
from ffrobot.fe_models.modal_body.unit_loads import work_on_modes

sys.path.append(str(Path(__file__).parents[1] / "mesh"))
import decks

ONE_CACHE = True  # one mesh, and each link once
E, RHO, L, H, B = 2.0e11, 7800.0, 0.4, 0.06, 0.02
EI, EA, MASS = E * B * H**3 / 12, E * B * H, RHO * B * H
GRIP = {"name": "grip", "position": 0.25, "mass": 0.5, "inertia": [1e-3, 1e-3, 1e-3]}
POINT = {"points": {"a": [0.17, 0.02, 0.005]}}


def bar(kind="beam", condition="craig-bampton", count=8, elements=20, interface=(), modes=None, **keys):
    """The keys of a bar that bends in the plane and stretches."""
    modes = {"count": count, "family": ["in-plane-bending", "axial"]} | (modes or {})
    keys |= {"name": "bar", "modes": modes, "interface": list(interface)}
    mesh = {"elements": elements} if kind == "beam" else {"size": 0.02}
    return link_keys(kind, L, rectangle(H, B), mesh, E=E, nu=0.3, rho=RHO, condition=condition, **keys)


def body_of(*args, **keys):
    return ffrobot.make_link(bar(*args, **keys)).body


SOLID = pytest.param("solid", marks=pytest.mark.nightly)  # test_modes_of_no_family has one


def test_interface_stiffness_of_a_beam():
    """The beam element of the textbook between its two interfaces: condensed statically, nothing is lost."""
    found = craig_bampton(body_of())
    names = ["root/x", "root/y", "root/rz", "tip/x", "tip/y", "tip/rz"]
    rows = [found.coordinates.index(name) for name in names]
    a, b, c, d = 12 * EI / L**3, 6 * EI / L**2, 4 * EI / L, 2 * EI / L
    expected = np.zeros((6, 6))
    expected[np.ix_([0, 3], [0, 3])] = EA / L * np.array([[1, -1], [-1, 1]])
    expected[np.ix_([1, 2, 4, 5], [1, 2, 4, 5])] = [[a, b, -a, b], [b, c, -b, d], [-a, -b, a, -b], [b, d, -b, c]]
    np.testing.assert_allclose(found.stiffness[np.ix_(rows, rows)], expected, atol=1e-8 * np.abs(expected).max())
    modes = [k for k, name in enumerate(found.coordinates) if name.startswith("mode/")]
    np.testing.assert_allclose(found.stiffness[np.ix_(rows, modes)], 0.0, atol=1e-8 * found.stiffness.max())


def test_fixed_interface_modes_are_those_of_a_clamped_beam():
    """β of 1 − cos β cosh β = 0; bending modes, and one along it at c/(2L)."""
    found = craig_bampton(body_of(count=4, elements=40))
    modes = [k for k, name in enumerate(found.coordinates) if name.startswith("mode/")]
    beta = np.array([4.730040744862704, 7.853204624095838, 10.995607838001671])
    expected = np.append(beta**2 * np.sqrt(EI / MASS) / L**2, np.pi / L * np.sqrt(E / RHO))
    np.testing.assert_allclose(np.sqrt(np.diag(found.stiffness)[modes]), np.sort(expected), rtol=1e-5)
    np.testing.assert_allclose(found.mass[np.ix_(modes, modes)], np.eye(4), atol=1e-8)


@pytest.mark.parametrize("kind", ["beam", SOLID])
def test_free_in_3d(kind):
    """Eigenfrequencies are those of the free link. Rigid motions: tests/exchange/test_bodies_out_and_in.py."""
    found = craig_bampton(body_of(kind, count=12, interface=[GRIP]))
    kept = [k for k, name in enumerate(found.coordinates) if name not in ("root/z", "root/rx", "root/ry")]
    omega2 = eigh(found.stiffness[np.ix_(kept, kept)], found.mass[np.ix_(kept, kept)], eigvals_only=True)
    other = body_of(kind, "cantilever", count=12, interface=[GRIP])
    np.testing.assert_allclose(np.sqrt(omega2[3:5]), free_frequencies(other)[:2], rtol=5e-4)


def test_a_root_beside_the_origin(tmp_path):
    """Coordinates are those of the interfaces: rigid motions strain nothing and weigh what a box weighs."""
    off = np.array([0.0, 0.03, -0.02])
    points, cells = decks.bar()
    (tmp_path / "bar.inp").write_text(decks.nodes(points) + decks.elements(cells))
    geometry = {"kind": "solid", "length": decks.LENGTH, "file": str(tmp_path / "bar.inp"), "origin": list(off)}
    body = ffrobot.make_link(bar("solid", count=4, modes={"family": "all"}) | {"geometry": geometry, "mesh": {}}).body
    found, mass = craig_bampton(body), RHO * decks.VOLUME
    rigid, center = np.zeros((len(found.coordinates), 6)), np.array([decks.LENGTH / 2, 0.0, 0.0]) - off
    for k, name in enumerate(found.coordinates):
        place, _, axis = name.partition("/")
        if place in body.interfaces:
            at = body.interfaces[place].position
            rigid[k] = np.eye(6)[3 + "xyz".index(axis[1])] if axis[0] == "r" else of_point(at)["xyz".index(axis)]
    assert np.abs(found.stiffness @ rigid).max() < 1e-10 * np.abs(found.stiffness).max()
    squares = np.square([decks.LENGTH, decks.HEIGHT, decks.WIDTH])
    about_center = np.block([[np.zeros((3, 6))], [np.zeros((3, 3)), np.diag(mass / 12 * (squares.sum() - squares))]])
    expected = mass * of_point(center).T @ of_point(center) + about_center
    np.testing.assert_allclose(rigid.T @ found.mass @ rigid, expected, atol=1e-9 * mass)


def of_point(x):
    """(3, 6) motion of a point x (3,) under unit translations, and rotations about the origin."""
    return np.hstack([np.eye(3), np.cross(np.eye(3), x).T])


def free_frequencies(body):
    """ω of a link in 3D, from the invariants of any frame: p with the frame's motion eliminated."""
    s, second = body.first_moment, body.second_moment
    rigid = np.array(
        [[body.mass, 0, -s[1]], [0, body.mass, s[0]], [-s[1], s[0], second[0, 0] + second[1, 1]]],
    )
    coupling = np.vstack([body.S_bar[:2], body.I_bar[0, 1] - body.I_bar[1, 0]])
    M = np.eye(body.mode_count) - coupling.T @ np.linalg.solve(rigid, coupling)
    return np.sqrt(eigh(body.stiffness, M, eigvals_only=True))


def test_modes_of_no_family():
    """Of a stout solid, at whose sections modes warp: the flexibility is that under a cantilever's condition, too."""
    keys = {"count": 12, "family": "all"}, {"geometry": bar("solid")["geometry"] | {"length": 0.06}}
    one, many = (body_of("solid", condition, modes=keys[0], **keys[1]) for condition in ("craig-bampton", "cantilever"))
    assert "local" in one.family
    assert (one.eigenmode_count, one.mode_count) == (12, 18)
    found, expected = (flexibility(body, "tip") for body in (one, many))
    size = np.sqrt(np.diag(expected))
    np.testing.assert_allclose(found / np.outer(size, size), expected / np.outer(size, size), atol=1e-6)


@pytest.mark.parametrize("kind", ["beam", SOLID])
def test_stresses_of_its_modes(kind):
    """K⁻¹b = Φ K_ff⁻¹ Φᵀb holds of stresses of interface loads; beams have both from equilibrium alone."""
    keys = bar(kind, interface=[GRIP], stress=POINT)
    body = ffrobot.make_link(keys).body
    work = work_on_modes(body.S_bar, body.I_bar, body.interfaces)
    for load in ("force/tip/x", "force/tip/y", "moment/tip/z", "force/grip/y", "moment/grip/z"):
        expected = body.stress["a"].static[:, body.stress_loads.index(load)]
        found = body.stress["a"].stress / np.diag(body.stiffness) @ work[load]
        np.testing.assert_allclose(found, expected, atol=1e-5 * np.abs(expected).max(), err_msg=load)
    again = restated(body, read_link(LinkTable(keys, Path("bar.toml"))))
    np.testing.assert_allclose(again.stress["a"].stress, body.stress["a"].stress, rtol=1e-9, atol=1e-3)


def test_file_has_it_for_exchange():
    made = ffrobot.make_link(bar(interface=[GRIP]))
    body = made.body
    found = craig_bampton(body)
    with h5py.File(made.path) as file:
        group = file["craig_bampton"]
        assert [name.decode() for name in group["coordinates"]] == found.coordinates
        for name in ("mass", "stiffness", "recovery"):
            np.testing.assert_array_equal(group[name], getattr(found, name))
    # Recovery: p under a unit motion of the tip moves the tip by one, and the grip not at all.
    column = found.recovery[:, found.coordinates.index("tip/y")]
    np.testing.assert_allclose(body.interfaces["tip"].translation[1] @ column, 1.0)
    np.testing.assert_allclose(body.interfaces["grip"].translation @ column, 0.0, atol=1e-9)


def test_without_attachment_modes_is_refused():
    with pytest.raises(InputError, match=r"modes\.attachment_modes: expected true, or nothing, with condition"):
        body_of(modes={"attachment_modes": False})


def test_interfaces_at_one_place_are_refused():
    with pytest.raises(InputError, match="expected interfaces that can move freely"):
        body_of(interface=[{"name": "grip", "position": 0.39999999}])
    for kind, first, second in (("beam", 0.1, 0.1), ("beam", 0.1, 0.0), ("beam", 0.1, L), ("solid", 0.1, 0.1)):
        places = [{"name": "grip", "position": first}, {"name": "hook", "position": second}]
        with pytest.raises(InputError, match=r"hook: expected a place apart from (grip|root|tip) with condition"):
            body_of(kind, interface=places)


@pytest.mark.parametrize("theory", ["euler-bernoulli", "timoshenko"])
def test_a_shaft_that_turns_about_itself(theory):
    """ρI_pL [1/3, 1/6; 1/6, 1/3] of the twist of its ends; a rigid turn has ρI_pL, and no motion is without energy."""
    length, height, width, rho = 0.6, 0.02, 0.01, 2700.0
    keys = {"model": {"theory": theory}, "modes": {"count": 12}, "name": "shaft"}
    link = beam_link(length, rectangle(height, width), 20, condition="craig-bampton", rho=rho, **keys)
    found = craig_bampton(ffrobot.make_link(link).body)
    spin = rho * (height * width**3 + width * height**3) / 12 * length
    ends = [found.coordinates.index(name) for name in ("root/rx", "tip/rx")]
    expected = spin * np.array([[1 / 3, 1 / 6], [1 / 6, 1 / 3]])
    np.testing.assert_allclose(found.mass[np.ix_(ends, ends)], expected, rtol=1e-6)
    turn = np.zeros(len(found.coordinates))
    turn[ends] = 1.0
    assert turn @ found.mass @ turn == pytest.approx(spin, rel=1e-9)
    assert np.abs(found.stiffness @ turn).max() < 1e-9 * np.abs(found.stiffness).max()
    scale = np.sqrt(np.diag(found.mass))
    assert np.linalg.eigvalsh(found.mass / np.outer(scale, scale))[0] > 1e-6
