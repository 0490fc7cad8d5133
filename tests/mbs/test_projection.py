"""Bodies of planar scenes in 3D: projected on z = 0, on planar joints where the scene has none for them."""

from types import SimpleNamespace

import numpy as np
import pytest
from checkpoint_scenes import tree_model
from material_points import random_cloud
from random_mechanisms import random_solid, stiffened

from ffrobot.mbs.model.body import from_modal_body
from ffrobot.mbs.model.build import build_model
from ffrobot.mbs.model.projection import projected
from ffrobot.mbs.model.system import MultibodySystem
from ffrobot.run.solve import solve_scene
from ffrobot.run.watcher import Watcher
from ffrobot.scene.load import make_scene

AT = [0.0, 0.0]


@pytest.fixture
def rng():
    return np.random.default_rng(7)


def arrays(body):
    own = (getattr(body, name) for name in ("first_moment", "second_moment", "S_bar", "I_bar", "S_bar_kl"))
    return [*own, body.stiffening.K_s, body.stiffening.K_x]


def test_kinetic_energy_is_that_of_every_point(rng):
    """Of a solid that moves across the plane, too: by its modes with m_ff = 1, not by turning."""
    cloud = random_cloud(rng, "b")
    body = projected(from_modal_body("b", cloud.modal_body()))
    scene = tree_model(SimpleNamespace(bodies=[body]), []).scene.model_copy(update={"space": "planar"})
    system = MultibodySystem(build_model(scene, [body]))
    core, scene, _ = system.integrated
    q, v = 0.3 * rng.standard_normal((2, 5, 3 + body.n_modes))
    expected = [cloud.kinetic_energy(*state) for state in zip(q, v, strict=True)]
    for model, following in ((core, scene), (system.core, system.scene)):
        np.testing.assert_allclose(model.states_totals(following, q, v)[:, 0], expected, rtol=1e-12)


def test_what_is_projected_stays(rng):
    once = projected(stiffened(rng, random_solid(rng, "b")))
    for found, expected in zip(arrays(projected(once)), arrays(once), strict=True):
        np.testing.assert_allclose(found, expected, rtol=0, atol=1e-13 * np.abs(expected).max())


def test_body_without_joints_moves_in_the_plane():
    """Under a force at its center and a moment: x = F t² / 2 m, θ = θ0 + ω t + M t² / 2 J."""
    m, J, F, M, end = 2.0, 0.03, 0.7, 0.05, 0.8
    tables = {
        "name": "puck", "gravity": AT,
        "body": [{"name": "puck", "rigid": {"mass": m, "inertia": J, "center": AT, "points": {"c": AT}}}],
        "initial": {"angles": {"puck": 0.4}, "rates": {"puck": 2.0}},
        "load": [{"point": "puck.c", "x": str(F), "moment": str(M)}],
        "analysis": [{"name": "pushed", "kind": "forward", "end": end, "output_step": end}],
    }  # fmt: skip
    (result,) = solve_scene(make_scene(**tables), Watcher()).analyses.values()
    assert MultibodySystem(result.run.model).plane is not None
    x, y, angle = result.run.q[-1]
    assert (x, y, angle) == pytest.approx((F * end**2 / (2 * m), 0.0, 0.4 + 2.0 * end + M * end**2 / (2 * J)), abs=1e-6)
