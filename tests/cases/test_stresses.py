"""Stresses of links in 3D: beams by closed forms."""

import numpy as np
import pytest
from beam_links import beam_link, tube
from tables_3d import revolute, scene

import ffrobot

LENGTH, R_OUTER, R_INNER = 0.8, 0.02, 0.016
AREA, INERTIA = np.pi * (R_OUTER**2 - R_INNER**2), np.pi / 4 * (R_OUTER**4 - R_INNER**4)
RHO, STATION, AT = 2700.0, 0.3, 0.02
FORCE, MOMENT, CARRIED = np.array([300.0, 20.0, -30.0]), np.array([8.0, -3.0, 5.0]), 1.5  # N, N·m, kg


HOLD = {"name": "hold", "joint": "roll", "value": "0"}
REST = {"name": "rest", "kind": "static"}


def cantilever(family, analysis, path=HOLD, damping=0.01, **more):
    """A tube held by a motor about its own axis, x along it."""
    points = {"up": [STATION, 0.0, AT], "side": [STATION, AT, 0.0]}
    modes, damping = {"count": 4, "family": family}, {"ratio": damping}
    link = beam_link(
        LENGTH, tube(2 * R_OUTER, 2 * R_INNER), 24, rho=RHO, modes=modes, damping=damping, stress={"points": points}
    )
    roll = revolute("roll", "ground", "tube.root", [1.0, 0.0, 0.0])
    tables = scene([{"name": "tube", "link": link}], [roll], analysis, trajectory=[path], **more)
    return ffrobot.make_scene(**tables)


@pytest.mark.parametrize("family", ["all", "in-plane-bending"])
def test_a_cantilever_under_force_and_moment_at_its_tip(family):
    """Under weight, too, two bendings, tension, torsion: σ = N/A + M_y z/I − M_z y/I, τ = M_x r/I_p + V Q/(I b)."""
    components = dict(
        zip(("x", "y", "z", "mx", "my", "mz"), map(repr, [*FORCE.tolist(), *MOMENT.tolist()]), strict=True)
    )
    arm, weight, payload = LENGTH - STATION, RHO * AREA * 9.81, CARRIED * 9.81
    M_y = MOMENT[1] - arm * (FORCE[2] - payload) + weight * arm**2 / 2
    M_z = MOMENT[2] + arm * FORCE[1]
    torsion = MOMENT[0] * AT / (2 * INERTIA)
    shear = 2 / 3 * (R_OUTER**3 - R_INNER**3) / (INERTIA * 2 * (R_OUTER - R_INNER))  # Q/(I b), for 1 N
    expected = {  # σ_xx, τ_xz, τ_xy
        "up": (FORCE[0] / AREA + M_y * AT / INERTIA, 0.0, shear * FORCE[1] - torsion),
        "side": (FORCE[0] / AREA - M_z * AT / INERTIA, shear * (FORCE[2] - payload - weight * arm) + torsion, 0.0),
    }
    peak = expected["up"][0]
    share = 2e-3 if family == "all" else 1e-9  # with modes the tip moves, by 1e-3 of the length: other arms
    keys = {"load": [{"point": "tube.tip", **components}], "payload": [{"point": "tube.tip", "mass": CARRIED}]}
    with ffrobot.solve(cantilever(family, REST, **keys)) as results:
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
    shaft = cantilever(
        "all",
        {"name": "spin", "kind": "pcid", "end": end, "output_step": 0.01, "tolerance": 1e-6},
        {"name": "spin", "joint": "roll", "value": law},
        damping=0.3,
        gravity=[0.0, 0.0, 0.0],
        payload=[{"point": "tube.tip", "mass": 0.1, "inertia": [J, J, J]}],
    )
    with ffrobot.solve(shaft) as results:
        u, found = results["spin/time"] / end, results["spin/stress/tube/points/side/stress"][:, 4]
    alpha = angle / end**2 * (60 * u - 180 * u**2 + 120 * u**3)
    expected = -(J / (2 * INERTIA) + RHO * (LENGTH - STATION)) * alpha * AT
    later = u > 0.1  # the start, where α gets a kink, has died away
    np.testing.assert_allclose(found[later], expected[later], rtol=0, atol=1e-3 * np.abs(expected).max())


@pytest.mark.parametrize("keys", [{"load": [{"point": "tube.mid", "z": "1.0"}]}, {"motors": "frame"}], ids=str)
def test_forces_between_the_ends_and_motors_on_frames_leave_mode_displacement(keys):
    """Of forces between the ends files of links have no static stress."""
    with ffrobot.solve(cantilever("all", REST, **keys)) as results:
        assert results.attributes("rest/stress/tube")["method"] == "mode displacement"
