"""Stresses of links in 3D: those of planar scenes put into space, and beams by closed forms."""

from pathlib import Path

import numpy as np
import pytest
import scenes_in_3d
from checkpoints import CASES

import ffrobot
from ffrobot.fe_models.link_file import link_keys

TIGHT = {"name": "inverse", "kind": "pcid", "end": 0.1, "output_step": 0.005, "tolerance": 1e-10}
STRAIGHT = {"name": "straight", "kind": "fcid", "shape": "zero", "end": 0.1, "output_step": 0.005}
REST = {"name": "rest", "kind": "static"}
GUESS = {
    "two_link": {"O": 0.0, "A": 1.0471975511965976},
    "slider_crank": {"O": 1.3548358281099402, "A": -1.7867568254780147, "B": 0.43192099736991246, "guide": 0.233},
}
POINTS = {"top": [0.1, 0.0025, 0.0], "axis": [0.05, 0.0, 0.0], "root": [0.0, -0.002, 0.001]}


def stressed(path):
    """The keys of a link file, with stresses at points and all that statics takes."""
    return dict(link_keys(path)) | {"stress": {"points": POINTS}}


def both(case, analyses, folder):
    """Results of a planar scene, its links with stresses, and of the same in 3D."""
    planar = scenes_in_3d.read(CASES / case / "scene.toml")
    planar.pop("pzt", None)
    planar["analysis"] = analyses
    for body in planar["body"]:
        if "link" in body:
            body["link"] = stressed(Path(body["link"]))
    tip = planar["trajectory"][0].get("point")
    planar["payload"] = [{"point": tip, "mass": 0.3}] if case == "two_link" else []
    spatial = scenes_in_3d.in_3d(planar) | {"initial": {"joints": GUESS[case]}, "payload": planar["payload"]}
    spatial["analysis"] = analyses
    return [
        ffrobot.solve(scenes_in_3d.write(tables, folder / f"{name}.toml"))
        for name, tables in (("planar", planar), ("spatial", spatial))
    ]


def compare(planar, spatial, analysis, link, share):
    names = [f"points/{point}/{key}" for point in POINTS for key in ("stress", "von_mises")]
    peak = max(planar[f"{analysis}/stress/{link}/points/{point}/von_mises"].max() for point in POINTS)
    for name in names:
        found, expected = (of[f"{analysis}/stress/{link}/{name}"] for of in (spatial, planar))
        np.testing.assert_allclose(found, expected, rtol=0, atol=share * peak, err_msg=name)
    for of in (planar, spatial):
        assert of.attributes(f"{analysis}/stress/{link}")["method"] == "mode acceleration"
    assert peak > 1e4


def test_two_links_with_a_payload(tmp_path):
    forward = {"name": "again", "kind": "forward", "actuation": "inverse", "apply": "trajectory", "tolerance": 1e-9}
    planar, spatial = both("two_link", [TIGHT, STRAIGHT, REST, forward], tmp_path)
    with planar, spatial:
        for analysis, share in (("inverse", 1e-8), ("straight", 1e-9), ("rest", 1e-8), ("again", 1e-6)):
            for link in ("link1", "link2"):
                compare(planar, spatial, analysis, link, share)


def test_a_loop(tmp_path):
    planar, spatial = both("slider_crank", [TIGHT | {"end": 0.05}], tmp_path)
    with planar, spatial:
        compare(planar, spatial, "inverse", "rod", 1e-8)


LENGTH, R_OUTER, R_INNER = 0.8, 0.02, 0.016
AREA, INERTIA = np.pi * (R_OUTER**2 - R_INNER**2), np.pi / 4 * (R_OUTER**4 - R_INNER**4)
RHO, STATION, AT = 2700.0, 0.3, 0.02
FORCE, MOMENT = np.array([300.0, 20.0, -30.0]), np.array([8.0, -3.0, 5.0])


def cantilever(family, damping=None, **more):
    """A tube held by a motor about its own axis, x along it."""
    link = {
        "name": "tube",
        "material": {"youngs_modulus": 70e9, "poissons_ratio": 0.33, "density": RHO},
        "geometry": {
            "kind": "beam", "length": LENGTH, "section": {"shape": "tube", "outer": 2 * R_OUTER, "inner": 2 * R_INNER},
        },
        "mesh": {"elements": 24},
        "reference": {"condition": "cantilever"},
        "modes": {"count": 4, "family": family},
        **({"damping": damping} if damping else {}),
        "stress": {"points": {"up": [STATION, 0.0, AT], "side": [STATION, AT, 0.0]}},
    }  # fmt: skip
    return {
        "name": "tube",
        "space": "spatial",
        "gravity": [0.0, 0.0, -9.81],
        "body": [{"name": "tube", "link": link}],
        "joint": [{"name": "roll", "type": "revolute", "between": ["ground", "tube.root"], "axis": [1.0, 0.0, 0.0]}],
        **more,
    }


@pytest.mark.parametrize("family", ["all", "in-plane-bending"])
def test_a_cantilever_under_force_and_moment_at_its_tip(family):
    """Two bendings, tension and torsion at once: σ = N/A + M_y z/I − M_z y/I, τ = M_x r/I_p + V Q/(I b)."""
    components = dict(
        zip(("x", "y", "z", "mx", "my", "mz"), map(repr, [*FORCE.tolist(), *MOMENT.tolist()]), strict=True)
    )
    keys = cantilever(
        family,
        load=[{"point": "tube.tip", **components}],
        trajectory=[{"name": "hold", "joint": "roll", "value": "0"}],
        analysis=[{"name": "rest", "kind": "static"}],
    )
    arm, weight = LENGTH - STATION, RHO * AREA * 9.81
    M_y = MOMENT[1] - arm * FORCE[2] + weight * arm**2 / 2
    M_z = MOMENT[2] + arm * FORCE[1]
    torsion = MOMENT[0] * AT / (2 * INERTIA)
    shear = 2 / 3 * (R_OUTER**3 - R_INNER**3) / (INERTIA * 2 * (R_OUTER - R_INNER))  # Q/(I b), for 1 N
    expected = {  # σ_xx, τ_xz, τ_xy
        "up": (FORCE[0] / AREA + M_y * AT / INERTIA, 0.0, shear * FORCE[1] - torsion),
        "side": (FORCE[0] / AREA - M_z * AT / INERTIA, shear * (FORCE[2] - weight * arm) + torsion, 0.0),
    }
    peak = expected["up"][0]
    share = 2e-3 if family == "all" else 1e-9  # with modes the tip moves, by 1e-3 of the length: other arms
    with ffrobot.solve(ffrobot.make_scene(**keys)) as results:
        for point, stress in expected.items():
            found = results[f"rest/stress/tube/points/{point}/stress"][0]
            np.testing.assert_allclose(found, [stress[0], 0, 0, 0, *stress[1:]], rtol=0, atol=share * peak)


@pytest.mark.parametrize("J", [0.01, 0.0])
def test_a_shaft_that_spins_up(J):
    """About its own axis, so slowly that its torsion does not ring: M_x(x) = [J + ρ I_p (L − x)] α of all beyond x.

    Of ρ I_p, all there is without a disc, static stresses of the file tell, and not the one mode of torsion: 20 % less.
    """
    angle, end = 0.5, 4.0
    law = f"{angle}*(10*(t/{end})**3 - 15*(t/{end})**4 + 6*(t/{end})**5)"
    keys = cantilever(
        "all",
        damping={"ratio": 0.3},
        gravity=[0.0, 0.0, 0.0],
        payload=[{"point": "tube.tip", "mass": 0.1, "inertia": [J, J, J]}],
        trajectory=[{"name": "spin", "joint": "roll", "value": law}],
        analysis=[{"name": "spin", "kind": "pcid", "end": end, "output_step": 0.01, "tolerance": 1e-6}],
    )
    with ffrobot.solve(ffrobot.make_scene(**keys)) as results:
        u, found = results["spin/time"] / end, results["spin/stress/tube/points/side/stress"][:, 4]
    alpha = angle / end**2 * (60 * u - 180 * u**2 + 120 * u**3)
    expected = -(J / (2 * INERTIA) + RHO * (LENGTH - STATION)) * alpha * AT
    later = u > 0.1  # the start, where α gets a kink, has died away
    np.testing.assert_allclose(found[later], expected[later], rtol=0, atol=1e-3 * np.abs(expected).max())


def test_a_force_between_the_ends_leaves_mode_displacement():
    """Its static stress is not in the file of the link."""
    keys = cantilever(
        "all",
        load=[{"point": "tube.mid", "z": "1.0"}],
        trajectory=[{"name": "hold", "joint": "roll", "value": "0"}],
        analysis=[{"name": "rest", "kind": "static"}],
    )
    with ffrobot.solve(ffrobot.make_scene(**keys)) as results:
        assert results.attributes("rest/stress/tube")["method"] == "mode displacement"


def test_motors_on_frames_leave_mode_displacement():
    keys = cantilever(
        "all",
        motors="frame",
        trajectory=[{"name": "hold", "joint": "roll", "value": "0"}],
        analysis=[{"name": "rest", "kind": "static"}],
    )
    with ffrobot.solve(ffrobot.make_scene(**keys)) as results:
        assert results.attributes("rest/stress/tube")["method"] == "mode displacement"
