"""Craig–Bampton: closed forms of its matrices, identities, stresses, and what is refused."""

import h5py
import numpy as np
import pytest
from scipy.linalg import eigh

from ffrobot.common.errors import InputError
from ffrobot.fe_models.link import make_link, restated
from ffrobot.fe_models.link_file import read_link
from ffrobot.fe_models.modal_body.craig_bampton import craig_bampton
from ffrobot.fe_models.modal_body.unit_loads import work_on_modes

E, RHO, L, H, B = 2.0e11, 7800.0, 0.4, 0.06, 0.02
EI, EA, MASS = E * B * H**3 / 12, E * B * H, RHO * B * H
LINK = """
name = "bar"
[material]
youngs_modulus = 2.0e11
poissons_ratio = 0.3
density = 7800.0
[geometry]
kind = "{kind}"
length = 0.4
section = {{ shape = "rectangle", height = 0.06, width = 0.02 }}
[mesh]
{mesh}
[reference]
condition = "{condition}"
[modes]
count = {count}
family = {family}
{more}
"""
GRIP = '[[interface]]\nname = "grip"\nposition = 0.25\nmass = 0.5\ninertia = [1e-3, 1e-3, 1e-3]\n'
IN_PLANE = '["in-plane-bending", "axial"]'
POINT = "[stress]\npoints = { a = [0.17, 0.02, 0.005] }\n"


@pytest.fixture
def bar(tmp_path):
    """The modal body of a bar, and its link file."""

    def make(kind="beam", condition="craig-bampton", count=8, family=IN_PLANE, more="", elements=20):
        mesh = f"elements = {elements}" if kind == "beam" else "size = 0.02"
        path = tmp_path / "bar.toml"
        keys = {"kind": kind, "condition": condition, "count": count, "family": family}
        path.write_text(LINK.format(mesh=mesh, more=more, **keys))
        return make_link(path, force=True).body, path

    return make


def test_interface_stiffness_of_a_beam(bar):
    """The beam element of the textbook between its two interfaces: condensed statically, nothing is lost."""
    found = craig_bampton(bar()[0])
    names = ["root/x", "root/y", "root/rz", "tip/x", "tip/y", "tip/rz"]
    rows = [found.coordinates.index(name) for name in names]
    a, b, c, d = 12 * EI / L**3, 6 * EI / L**2, 4 * EI / L, 2 * EI / L
    expected = np.zeros((6, 6))
    expected[np.ix_([0, 3], [0, 3])] = EA / L * np.array([[1, -1], [-1, 1]])
    expected[np.ix_([1, 2, 4, 5], [1, 2, 4, 5])] = [[a, b, -a, b], [b, c, -b, d], [-a, -b, a, -b], [b, d, -b, c]]
    np.testing.assert_allclose(found.stiffness[np.ix_(rows, rows)], expected, atol=1e-8 * np.abs(expected).max())
    modes = [k for k, name in enumerate(found.coordinates) if name.startswith("mode/")]
    np.testing.assert_allclose(found.stiffness[np.ix_(rows, modes)], 0.0, atol=1e-8 * found.stiffness.max())


def test_fixed_interface_modes_are_those_of_a_clamped_beam(bar):
    """β of 1 − cos β cosh β = 0; bending modes, and one along it at c/(2L)."""
    found = craig_bampton(bar(count=4, elements=40)[0])
    modes = [k for k, name in enumerate(found.coordinates) if name.startswith("mode/")]
    beta = np.array([4.730040744862704, 7.853204624095838, 10.995607838001671])
    expected = np.append(beta**2 * np.sqrt(EI / MASS) / L**2, np.pi / L * np.sqrt(E / RHO))
    np.testing.assert_allclose(np.sqrt(np.diag(found.stiffness)[modes]), np.sort(expected), rtol=1e-5)
    np.testing.assert_allclose(found.mass[np.ix_(modes, modes)], np.eye(4), atol=1e-8)


@pytest.mark.parametrize("kind", ["beam", "solid"])
def test_free_in_3d(bar, kind):
    """Rigid motions strain nothing and weigh what the link weighs; eigenfrequencies are those of the free link."""
    body, _ = bar(kind, count=12, more=GRIP)
    found = craig_bampton(body)
    rigid = np.zeros((len(found.coordinates), 3))
    for k, name in enumerate(found.coordinates):
        place, _, axis = name.partition("/")
        if place in body.interfaces:
            x, y, _ = body.interfaces[place].position
            rigid[k] = {"x": (1, 0, -y), "y": (0, 1, x), "rz": (0, 0, 1)}.get(axis, (0, 0, 0))
    scale = np.abs(found.stiffness).max()
    assert np.abs(found.stiffness @ rigid).max() < 1e-7 * scale
    s, second = body.first_moment, body.second_moment
    expected = [[body.mass, 0, -s[1]], [0, body.mass, s[0]], [-s[1], s[0], second[0, 0] + second[1, 1]]]
    np.testing.assert_allclose(rigid.T @ found.mass @ rigid, expected, atol=1e-8 * body.mass)
    kept = [k for k, name in enumerate(found.coordinates) if name not in ("root/z", "root/rx", "root/ry")]
    omega2 = eigh(found.stiffness[np.ix_(kept, kept)], found.mass[np.ix_(kept, kept)], eigvals_only=True)
    other, _ = bar(kind, "cantilever", count=12, more=GRIP)
    np.testing.assert_allclose(np.sqrt(omega2[3:5]), free_frequencies(other)[:2], rtol=5e-4)


def free_frequencies(body):
    """ω of a link in 3D, from the invariants of any frame: p with the frame's motion eliminated."""
    s, second = body.first_moment, body.second_moment
    rigid = np.array(
        [[body.mass, 0, -s[1]], [0, body.mass, s[0]], [-s[1], s[0], second[0, 0] + second[1, 1]]],
    )
    coupling = np.vstack([body.S_bar[:2], body.I_bar[0, 1] - body.I_bar[1, 0]])
    M = np.eye(body.mode_count) - coupling.T @ np.linalg.solve(rigid, coupling)
    return np.sqrt(eigh(body.stiffness, M, eigvals_only=True))


@pytest.mark.parametrize("kind", ["beam", "solid"])
def test_flexibility_at_interfaces_is_that_of_the_finite_element_model(bar, kind):
    """The same as with attachment modes under a cantilever's condition, with one mode and interfaces in between."""
    one, many = bar(kind, count=1, more=GRIP)[0], bar(kind, "cantilever", count=6, more=GRIP)[0]
    rows = [np.concatenate([body.interfaces[n].translation[:2] for n in ("grip", "tip")]) for body in (one, many)]
    found, expected = (row / np.diag(body.stiffness) @ row.T for row, body in zip(rows, (one, many), strict=True))
    np.testing.assert_allclose(found, expected, atol=1e-7 * np.abs(expected).max())
    assert one.eigenmode_count == 1
    assert one.mode_count == 1 + 6  # x, y and the rotation at grip and tip


@pytest.mark.parametrize("kind", ["beam", "solid"])
def test_stresses_of_its_modes(bar, kind):
    """K⁻¹b = Φ K_ff⁻¹ Φᵀb holds of stresses of interface loads; beams have both from equilibrium alone."""
    body, path = bar(kind, more=GRIP + POINT)
    work = work_on_modes(body.S_bar, body.I_bar, body.interfaces)
    for load in ("force/tip/x", "force/tip/y", "moment/tip/z", "force/grip/y", "moment/grip/z"):
        expected = body.stress["a"].static[:, body.stress_loads.index(load)]
        found = body.stress["a"].stress / np.diag(body.stiffness) @ work[load]
        np.testing.assert_allclose(found, expected, atol=1e-5 * np.abs(expected).max(), err_msg=load)
    again = restated(body, read_link(path))
    np.testing.assert_allclose(again.stress["a"].stress, body.stress["a"].stress, rtol=1e-9, atol=1e-3)


def test_file_has_it_for_exchange(bar, tmp_path):
    body, path = bar(more=GRIP)
    found = craig_bampton(body)
    with h5py.File(path.with_suffix(".h5")) as file:
        group = file["craig_bampton"]
        assert [name.decode() for name in group["coordinates"]] == found.coordinates
        for name in ("mass", "stiffness", "recovery"):
            np.testing.assert_array_equal(group[name], getattr(found, name))
    # Recovery: p under a unit motion of the tip moves the tip by one, and the grip not at all.
    column = found.recovery[:, found.coordinates.index("tip/y")]
    np.testing.assert_allclose(body.interfaces["tip"].translation[1] @ column, 1.0)
    np.testing.assert_allclose(body.interfaces["grip"].translation @ column, 0.0, atol=1e-9)


def test_without_attachment_modes_is_refused(bar):
    with pytest.raises(InputError, match=r"modes\.attachment_modes: expected true, or nothing, with condition"):
        bar(more="attachment_modes = false")


def test_interfaces_at_one_place_are_refused(bar):
    near = '[[interface]]\nname = "grip"\nposition = 0.39999999\n'
    with pytest.raises(InputError, match="expected interfaces that can move freely"):
        bar(more=near)


@pytest.mark.parametrize("theory", ["euler-bernoulli", "timoshenko"])
def test_a_shaft_that_turns_about_itself(tmp_path, theory):
    """ρI_pL [1/3, 1/6; 1/6, 1/3] of the twist of its ends; a rigid turn has ρI_pL, and no motion is without energy."""
    length, height, width, rho = 0.6, 0.02, 0.01, 2700.0
    path = tmp_path / "shaft.toml"
    path.write_text(f"""
        name = "shaft"
        material = {{ youngs_modulus = 70e9, poissons_ratio = 0.33, density = {rho} }}
        [geometry]
        kind = "beam"
        length = {length}
        section = {{ shape = "rectangle", height = {height}, width = {width} }}
        [mesh]
        elements = 20
        [model]
        theory = "{theory}"
        [reference]
        condition = "craig-bampton"
        [modes]
        count = 12
    """)
    found = craig_bampton(make_link(path).body)
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
