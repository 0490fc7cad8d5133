"""Stresses of links in 3D: beams by closed forms."""

import numpy as np
import pytest

import ffrobot

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
