"""Links in 3D in pieces: bent far in both planes and twisted, told as the one link, and in the plane as there."""

import numpy as np
import pytest
from beam_links import beam_link
from exact_rod import rigidities, tip_of
from tables_3d import joint, revolute, rigid, scene

import ffrobot
from ffrobot.common.errors import InputError
from ffrobot.common.rotations import exponential, of_quaternion, of_rpy

BENT_AND_TWISTED = ["in-plane-bending", "out-of-plane-bending", "torsion"]
RPY = (0.3, -0.4, 0.7)
SIDE = 0.01  # m, of the square section
SOFT = 1e9
EI = SOFT * SIDE**4 / 12
MOMENT = ("mx", "my", "mz")


def link(modulus=SOFT, condition="cantilever", width=SIDE, **keys):
    section = {"shape": "rectangle", "height": SIDE, "width": width}
    modes = {"count": 8, "family": BENT_AND_TWISTED}
    return beam_link(1.0, section, 16, E=modulus, nu=0.3, condition=condition, name="link", modes=modes) | keys


def solved(body, pieces=None, **keys):
    divided = {} if pieces is None else {"pieces": pieces}
    bodies = body if isinstance(body, list) else [{"name": "beam", "link": body} | divided]
    wall = joint("wall", "weld", "ground", "beam.root", rpy=RPY)
    tables = scene(bodies, [wall], {"name": "rest", "kind": "static"}, gravity=[0.0, 0.0, 0.0])
    return ffrobot.solve(ffrobot.make_scene(**(tables | keys)))


def acting(vector, components="xyz"):
    """Load on the tip."""
    return [{"point": "beam.tip"} | dict(zip(components, map(repr, vector.tolist()), strict=True))]


def bent(force):
    """Place (3,) of the tip and its tangent (3,) of the elastica under a force (3,), in axes of the root."""
    moved, turned = tip_of(rigidities(SIDE, SIDE, SOFT, 0.3), 1.0, force, np.zeros(3))
    return np.array([1.0, 0.0, 0.0]) + moved, exponential(turned)[:, 0]


@pytest.mark.parametrize("pieces", [4, 5], ids=["at a cut", "within a piece"])
def test_stresses_are_those_of_the_bent_link(pieces):
    """Of equilibrium: the moment at the root by the elastica, in the middle by the tip's arm, N/A − M_z y/I + M_y z/I.

    The one link, whose loads act on it undeformed, is 19 % off at the root.
    """
    A, k, (y, z) = of_rpy(*RPY), 2.0, (SIDE / 2, SIDE / 3)
    across = np.array([0.0, 0.6 * k * EI, 0.8 * k * EI])
    force = A @ across
    points = {"root": [0.0, y, z], "middle": [0.5, y, z]}
    with solved(link(stress={"points": points}), pieces, load=acting(force)) as results:
        found = {name: results[f"rest/stress/beam/points/{name}/stress"][0] for name in points}
        arm = results["rest/points/beam.tip/position"][0] - results["rest/points/beam.mid/position"][0]
        axes = of_quaternion(results["rest/points/beam.mid/quaternion"])[0]
        assert results.attributes("rest/stress/beam")["method"] == "mode acceleration"
    N, M = axes[:, 0] @ force, axes.T @ np.cross(arm, force)
    middle = N / SIDE**2 + 12 * (M[1] * z - M[2] * y) / SIDE**4
    root = -k * SOFT * bent(across)[0][0] * (0.6 * y + 0.8 * z)
    np.testing.assert_allclose([found["root"][0], found["middle"][0]], [root, middle], rtol=2e-3)


@pytest.mark.parametrize(
    ("condition", "stiffened", "order", "least"),
    [("cantilever", False, 2, 1e-2), ("simply-supported", None, 4, 5e-4),
     pytest.param("simply-supported", False, 2, 1e-2, marks=pytest.mark.nightly),
     pytest.param("cantilever", None, 4, 5e-4, marks=pytest.mark.nightly)],
)  # fmt: skip
def test_elastica_in_an_oblique_plane(condition, stiffened, order, least):
    """A tip force across that bends the link by two thirds of its length, at any angle.

    To fourth order of the pieces, whose bending shortens them; to second where the scene says that it does not.
    """
    A, angle, k = of_rpy(*RPY), 0.8, 2.0
    across = np.array([0.0, np.cos(angle), np.sin(angle)])
    exact, tangent = (A @ of for of in bent(k * EI * across))
    off, turned = [], []
    for pieces in (2, 4, 8):
        keys = {"load": acting(A @ across * k * EI), "geometric_stiffening": stiffened}
        with solved(link(condition=condition), pieces, **keys) as results:
            off.append(np.linalg.norm(results["rest/points/beam.tip/position"][0] - exact))
            section = of_quaternion(results["rest/points/beam.tip/quaternion"][0])
            turned.append(np.linalg.norm(section[:, 0] - tangent))
            assert results.attributes("rest/bodies/beam")["pieces"] == pieces
            assert results.attributes("/")["geometric_stiffening"] == (stiffened is None)
    assert off[0] < least  # one frame is off by a quarter of the length
    for errors in (off, turned):
        orders = np.log2(np.array(errors[:-1]) / errors[1:])
        assert np.all(np.abs(orders - order) < 0.4), orders


@pytest.mark.parametrize(("pieces", "known"), [(2, True), (3, False)])
def test_loads_between_the_ends_of_a_piece_leave_its_link_as_it_is(pieces, known):
    """The middle is an end of pieces, or the middle of one, of whose loads files have no geometric stiffness."""
    load = [{"point": "beam.mid", "x": "1e-3"}]
    with solved(link(), pieces, load=load) as results:
        assert results.attributes("/")["geometric_stiffening"] == known
    if not known:
        with pytest.raises(InputError, match="expected, with geometric_stiffening, a point whose loads' geometric"):
            solved(link(), pieces, load=load, geometric_stiffening=True)


def test_a_moment_about_an_oblique_axis_bends_to_a_circle_and_twists():
    """Torque T along the axis alone: twist T L/GJ as by one link; a moment M across alone: a circle of radius EI/M."""
    with solved(link(), 3, load=acting(of_rpy(*RPY) @ [0.02, 0.0, 0.0], MOMENT)) as results:
        section = of_rpy(*RPY).T @ of_quaternion(results["rest/points/beam.tip/quaternion"][0])
        GJ = SOFT / 2.6 * 0.1406 * SIDE**4  # of a square: Roark's Formulas for Stress and Strain, table 10.1
        assert np.arctan2(section[2, 1], section[1, 1]) == pytest.approx(0.02 / GJ, rel=1e-3)
    angle, turn = 0.8, 1.2
    axis = np.array([0.0, -np.sin(angle), np.cos(angle)])
    with solved(link(), 12, load=acting(of_rpy(*RPY) @ axis * turn * EI, MOMENT)) as results:
        tip = of_rpy(*RPY).T @ results["rest/points/beam.tip/position"][0]
    across = np.array([0.0, np.cos(angle), np.sin(angle)])
    exact = np.array([np.sin(turn) / turn, 0.0, 0.0]) + across * (1 - np.cos(turn)) / turn
    assert np.linalg.norm(tip - exact) < 5e-4  # a twelfth of turn²/24 in twelve pieces


CERAMIC = {"width": 0.01, "thickness": 5e-4, "modulus": 1e9, "d31": 1.1e-10, "allocation": "least-squares"}


@pytest.mark.parametrize("pieces", [6, 12])
@pytest.mark.parametrize("bends", ["in-plane", "out-of-plane"])
def test_patches_across_cuts_bend_a_link_to_a_circle(pieces, bends):
    """Four patches side by side, each across cuts, and all of one voltage: curvature c V/EI everywhere."""
    t, turn, row = CERAMIC["thickness"], 1.2, 1 if bends == "in-plane" else 2
    per_volt = CERAMIC["modulus"] * CERAMIC["d31"] * CERAMIC["width"] * (SIDE + t) / 2
    keys = {
        "pzt": [{"body": "beam", "count": 4, "length": 0.25, "bends": bends, "structural": False, **CERAMIC}],
        "load": [{"pzt": "beam", "voltage": [repr(turn * EI / per_volt)] * 4}],
    }
    with solved(link(), pieces, **keys) as results:
        tip = of_rpy(*RPY).T @ results["rest/points/beam.tip/position"][0]
    exact = np.zeros(3)
    exact[0], exact[row] = np.sin(turn) / turn, (1 - np.cos(turn)) / turn
    assert np.linalg.norm(tip - exact) < 1.5e-3 / pieces**4


STIFF = 5e11
LAW = "(10*t**3-15*t**4+6*t**5)"


def arm(pieces, **keys):
    """Two links of which the second turns in a plane that is not the first's, under a load, driven."""
    divided = {} if pieces is None else {"pieces": pieces}
    tube = link(STIFF, keys.pop("condition", "cantilever"), 0.02)
    bodies = [{"name": name, "link": tube | {"name": name}, **divided} for name in ("upper", "fore")]
    return solved(
        bodies,
        gravity=[0.0, 0.0, -9.81],
        joint=[
            revolute("waist", "ground", "upper.root"),
            revolute("elbow", "upper.tip", "fore.root", [0.0, -1.0, 0.0]),
        ],
        payload=[{"point": "fore.tip", "mass": 0.2, "center": [0.0, 0.05, 0.0]}],
        load=[{"point": "upper.mid", "z": "-2.0"}],
        trajectory=[{"name": "tip", "point": "fore.tip", "y": f"0.4*{LAW}", "z": f"0.3-0.4*{LAW}"}],
        initial={"state": "static", "joints": {"elbow": 0.3}},
        **keys,
    )


INVERSE = {"name": "inverse", "kind": "pcid", "end": 1.0, "output_step": 0.02, "tolerance": 1e-6}


@pytest.mark.parametrize("condition", ["cantilever", pytest.param("simply-supported", marks=pytest.mark.nightly)])
def test_rates_of_the_one_link_are_derivatives(condition):
    """R, e and p of the link as found from the pieces, and the velocities that are told beside them."""
    fine = INVERSE | {"end": 0.2, "output_step": 0.0005}
    with arm(2, condition=condition, analysis=[fine]) as results:
        body = {key: results[f"inverse/bodies/fore/{key}"] for key in results.names("inverse/bodies/fore")}
        time = results["inverse/time"]
        deflection = results["inverse/points/fore.mid/deflection"]
        position = results["inverse/points/fore.mid/position"]
    step = time[2] - time[0]
    for key, rate in (("position", "velocity"), ("modal", "modal_velocity")):
        difference = (body[key][2:] - body[key][:-2]) / step
        size = np.abs(body[rate]).max()
        np.testing.assert_allclose(difference, body[rate][1:-1], rtol=0, atol=2e-2 * size, err_msg=key)
    A = of_quaternion(body["quaternion"])
    spin = (A[2:] - A[:-2]) / step @ np.swapaxes(A[1:-1], -1, -2)
    found = np.stack([spin[:, 2, 1], spin[:, 0, 2], spin[:, 1, 0]], axis=1)
    size = np.abs(body["angular_velocity"]).max()
    np.testing.assert_allclose(found, body["angular_velocity"][1:-1], rtol=0, atol=1e-3 * size)
    again = body["position"] + np.einsum("tij,tj->ti", A, np.array([0.5, 0.0, 0.0]) + deflection)
    np.testing.assert_allclose(again, position, rtol=0, atol=1e-12)


def test_auto_takes_as_many_as_the_deflection_needs():
    """More for a soft link than for a stiff one, none for one that hardly bends: tips to 1e-3 of the length."""
    exact = of_rpy(*RPY) @ bent([0.0, 2.0 * EI, 0.0])[0]
    load = acting(of_rpy(*RPY)[:, 1] * 2.0 * EI)
    with solved(link(), "auto", load=load) as results:
        assert 10 <= results.attributes("rest/bodies/beam")["pieces"] <= 20
        assert np.linalg.norm(results["rest/points/beam.tip/position"][0] - exact) < 1e-3
    with solved(link(1e3 * SOFT), "auto", load=load) as results:
        assert "pieces" not in results.attributes("rest/bodies/beam")


SOLID = {"geometry": link()["geometry"] | {"kind": "solid"}}
MISTAKES = {
    r'body "beam": expected "pieces" with "link" alone, found "modes"': {
        "body": [{"name": "beam", "link": link(), "pieces": 2, "modes": 2}]
    },
    r'expected "pieces" with "link" alone, found "rigid"': {"body": [rigid("beam", tip=[1.0, 0, 0]) | {"pieces": 2}]},
    "expected none with subdivided bodies": {"actuation_points": [{"body": "beam"}]},
    r'geometry.kind: expected "beam" of a subdivided body': {
        "body": [{"name": "beam", "link": link(mesh={}) | SOLID, "pieces": 2}]
    },
    r'motors: expected "section" with subdivided bodies \("beam"\), found "frame"': {"motors": "frame"},
    r"damping: expected none or rayleigh = \[0.0, b\] of a subdivided body": {
        "body": [{"name": "beam", "link": link(damping={"ratio": 0.01}), "pieces": 2}]
    },
    r'modes.family: expected "in-plane-bending", "out-of-plane-bending" among those of a subdivided body': {
        "body": [{"name": "beam", "link": link(modes={"count": 2, "family": ["torsion"]}), "pieces": 2}]
    },
}  # fmt: skip


@pytest.mark.parametrize("message", MISTAKES)
def test_what_cannot_be_in_pieces_is_refused(message):
    body = [{"name": "beam", "link": link(), "pieces": 2}]
    with pytest.raises(InputError, match=message):
        solved(**({"body": body} | MISTAKES[message]))
