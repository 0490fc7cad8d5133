"""Stresses by mode acceleration, from the scene on: closed forms that few modes, or none of the family, would miss."""

from dataclasses import replace

import numpy as np
import tables_3d
from beam_links import beam_link, rectangle

import ffrobot
from ffrobot.fe_models.modal_body import StressPoint
from ffrobot.fe_models.modal_body_file import read_modal_body, write_modal_body

E, RHO, L, H, B = 2.0e11, 7800.0, 0.4, 0.06, 0.02
AREA, MODULUS = H * B, B * H**2 / 6  # of the section; I/c
PLACES = (0.0, 0.1, 0.2, 0.398, 0.4)


def link(condition="cantilever", modes=None, places=PLACES, **keys):
    """A steel bar with stress points on its upper side, y = H/2."""
    modes = modes or {"count": 10, "family": "in-plane-bending", "attachment_modes": False}
    stress = {"points": {f"x{k}": [x, H / 2, 0.0] for k, x in enumerate(places)}}
    bar = beam_link(L, rectangle(H, B), 20, E=E, nu=0.3, rho=RHO, condition=condition, name="arm", modes=modes)
    return bar | {"stress": stress} | keys


def solved(folder, body, joint="weld", kind=None, body_keys=None, **keys):
    """Results of the one link `body` on the ground at its root, and its upper fibre's σ_xx (T, places)."""
    arm = {"name": "arm", "link" if isinstance(body, dict) else "modal": body, **(body_keys or {})}
    run, root = {"name": "run", **(kind or {"kind": "static"})}, tables_3d.joint("root", joint, "ground", "arm.root")
    tables = tables_3d.planar([arm], [root], run, **{"gravity": (0.0, 0.0)} | keys)
    results = ffrobot.solve(ffrobot.make_scene(folder=folder, **tables))
    points = sorted(name for name in results.modal_body("arm").stress)
    return results, np.stack([results[f"run/stress/arm/points/{name}/stress"][:, 0] for name in points], axis=1)


def test_spin_pulls_the_link_though_it_has_no_axial_modes(tmp_path):
    """N = ω² (ρA (L² − x²)/2 + m L)."""
    omega = 20.0
    kind = {"kind": "pcid", "end": 0.05, "output_step": 0.01}
    keys = {
        "trajectory": [{"name": "turn", "joint": "root", "value": f"{omega}*t"}],
        "payload": [{"point": "arm.tip", "mass": 0.5}],
    }
    _, stress = solved(tmp_path, link(), joint="revolute", kind=kind, **keys, initial={"state": "static"})
    x = np.array(PLACES)
    expected = omega**2 * (RHO * AREA * (L**2 - x**2) / 2 + 0.5 * L) / AREA
    np.testing.assert_allclose(stress.mean(axis=0), expected, rtol=1e-6)


def test_falling_rod_breaks_at_a_third(tmp_path):
    """A rod let go from the horizontal has the moment −m g x (1 − x/L)²/4: largest at L/3. It has no modes at all."""
    places = (L / 5, L / 3, L / 2)
    kind = {"kind": "forward", "end": 1e-6, "output_step": 1e-6}
    _, stress = solved(tmp_path, link(places=places), "revolute", kind, {"modes": 0}, gravity=[0.0, -9.81])
    x = np.array(places)
    moment = RHO * AREA * L * 9.81 * x * (1 - x / L) ** 2 / 4
    np.testing.assert_allclose(stress[0], -moment / MODULUS, rtol=1e-9)


def dynamic(folder, count, attachment_modes=False):
    """A swing under gravity with a payload."""
    modes = {"count": count, "family": "in-plane-bending", "attachment_modes": attachment_modes}
    body = link("simply-supported", modes, damping={"ratio": 0.01})
    kind = {"kind": "pcid", "end": 1.0, "output_step": 0.01}
    path = [{"name": "turn", "joint": "root", "value": "1.5*(10*t**3 - 15*t**4 + 6*t**5)"}]
    keys = {"trajectory": path, "payload": [{"point": "arm.tip", "mass": 2.0, "inertia": 0.02}]}
    return solved(folder, body, joint="revolute", kind=kind, gravity=[0.0, -9.81], initial={"state": "static"}, **keys)


def test_results_say_what_stresses_are_computed_from(tmp_path):
    results, stress = dynamic(tmp_path, 2)
    body, found = results.modal_body("arm"), results.stress_recovery("run", "arm")
    assert found.method == "mode acceleration"
    assert {"t_y", "r_z", "omega_zz", "force/root/y", "moment/root/z", "force/tip/y"} <= set(found.loads)
    static = body.stress["x1"].static[:, [body.stress_loads.index(name) for name in found.loads]]
    again = found.modal @ body.stress["x1"].stress.T + found.sizes @ static.T
    np.testing.assert_allclose(again[:, 0], stress[:, 1], rtol=1e-12)


def test_files_without_static_stresses_give_mode_displacement(tmp_path):
    """As files of earlier versions."""
    ffrobot.make_link(link(), tmp_path / "arm.h5")
    new = read_modal_body(tmp_path / "arm.h5")
    points = {name: StressPoint(at.position, at.stress, at.strain) for name, at in new.stress.items()}
    write_modal_body(tmp_path / "old.h5", replace(new, stress=points, stress_loads=()))
    load = [{"point": "arm.tip", "moment": "10"}]
    results, stress = solved(tmp_path, tmp_path / "old.h5", load=load)
    p = results.modal("run", "arm")[0]
    expected = [points[f"x{k}"].stress[0] @ p for k in range(len(PLACES))]
    np.testing.assert_allclose(stress[0], expected, rtol=1e-12)
    assert abs(stress[0, 3]) < 0.02 * 10.0 / MODULUS  # at 0.995 L
    assert results.stress_recovery("run", "arm").method == "mode displacement"
