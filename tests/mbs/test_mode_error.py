"""The estimated error of modes of links with attachment modes, against links with many more."""

import numpy as np
import pytest

import ffrobot as library
from ffrobot.run.solve import solve


def arm(modes, payload, attachment_modes=True, rise=1.0, state="static"):
    """Two steel links under gravity, joints on quintic paths."""
    sizes = {"link1": (0.9, 0.014, "simply-supported"), "link2": (0.8, 0.012, "cantilever")}

    def link(name):
        length, height, condition = sizes[name]
        return {
            "name": name,
            "material": {"youngs_modulus": 2.1e11, "density": 7850.0},
            "geometry": {
                "kind": "beam", "length": length, "section": {"shape": "rectangle", "height": height, "width": 0.03},
            },
            "mesh": {"elements": 40},
            "reference": {"condition": condition},
            "modes": {"count": modes, "family": "in-plane-bending", "attachment_modes": attachment_modes},
            "damping": {"ratio": 0.005},
        }  # fmt: skip

    s = f"(t/{rise})"
    path = f"(10*{s}**3-15*{s}**4+6*{s}**5)"
    return library.make_scene(
        name="arm",
        space="planar",
        gravity=[0.0, -9.81],
        body=[{"name": name, "link": link(name)} for name in sizes],
        joint=[
            {"name": "O", "type": "revolute", "between": ["ground", "link1.root"]},
            {"name": "A", "type": "revolute", "between": ["link1.tip", "link2.root"]},
        ],
        payload=[{"point": "link2.tip", "mass": payload}],
        initial={"state": state},
        trajectory=[
            {"name": "shoulder", "joint": "O", "value": f"0.6*{path}"},
            {"name": "elbow", "joint": "A", "value": f"-0.9*{path}"},
        ],
        analysis=[{"name": "inverse", "kind": "pcid", "end": rise, "output_step": 0.005, "tolerance": 1e-6}],
    )


@pytest.mark.parametrize(
    ("payload", "rise", "state"), [(1.5, 1.0, "static"), (0.4, 0.6, "static"), (1.5, 1.0, "undeformed")]
)
def test_estimate_is_about_the_error_of_moments(payload, rise, state):
    """Within 0.3 and 3 times, for errors of 1e-6 at rest and of 5e-4 where links start unbent under their weight."""
    coarse, fine = (solve(arm(modes, payload, rise=rise, state=state)) for modes in (4, 10))
    moments = [solution.outcomes["inverse"].tau for solution in (coarse, fine)]
    errors = np.abs(moments[0] - moments[1]).max(axis=0) / np.abs(moments[1]).max(axis=0)
    estimate = coarse.analyses["inverse"].mode_error
    assert estimate is not None
    assert 0.3 * errors.max() < estimate < 3 * errors.max()
    assert (estimate < 1e-5) == (state == "static")


def test_nothing_is_known_without_attachment_modes():
    assert solve(arm(4, 1.5, attachment_modes=False)).analyses["inverse"].mode_error is None


def test_a_jolt_at_the_start_is_told_from_a_start_in_equilibrium():
    """Undeformed under gravity all of the sag begins to ring; from equilibrium on a smooth path nothing does."""
    jolts = [solve(arm(4, 1.5, state=state)).analyses["inverse"].start_jolt for state in ("static", "undeformed")]
    assert jolts[0] < 1e-4
    assert 0.1 < jolts[1] < 1.5
