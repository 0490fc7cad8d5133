"""The estimate of what missing modes make of results, against links with all modes of their mesh."""

import pytest
from beam_links import beam_link

import ffrobot
from ffrobot.run.modal_error import modal_errors
from ffrobot.run.mode_choice import reported_modes
from ffrobot.run.mode_search import difference
from ffrobot.run.solve import solve_scene


def arm(modes, start):
    section = {"shape": "rectangle", "height": 0.012, "width": 0.03}
    link = beam_link(
        0.8,
        section,
        20,
        E=2.1e11,
        nu=None,
        rho=7850.0,
        condition=None,
        name="link",
        damping={"ratio": 0.01},
        modes={"family": "in-plane-bending"} | modes,
    )
    of = {"b1": "simply-supported", "b2": "cantilever"}
    s = "(10*(2*t)**3 - 15*(2*t)**4 + 6*(2*t)**5)"
    scene = ffrobot.make_scene(
        name="arm",
        gravity=[0.0, -9.81],
        body=[{"name": name, "link": link | {"reference": {"condition": how}}} for name, how in of.items()],
        joint=[
            {"name": "O", "type": "revolute", "between": ["ground", "b1.root"]},
            {"name": "A", "type": "revolute", "between": ["b1.tip", "b2.root"]},
        ],
        payload=[{"point": "b2.tip", "mass": 1.0}],
        initial={"state": start},
        trajectory=[
            {"name": "first", "joint": "O", "value": f"0.2 + 0.5*{s}"},
            {"name": "second", "joint": "A", "value": f"0.6 - 0.8*{s}"},
        ],
        analysis=[{"name": "swing", "kind": "pcid", "end": 0.5, "output_step": 0.002, "tolerance": 1e-7}],
    )
    return solve_scene(scene)


@pytest.mark.parametrize("start", ["static", "undeformed"])
def test_no_error_is_above_twice_the_estimate(start):
    found, converged = arm({}, start), arm({"count": 16}, start)
    quantities = [reported_modes(one.analyses["swing"]) for one in (found, converged)]
    errors, estimate = difference(*quantities), modal_errors(found)["swing"]
    assert errors.keys() == estimate.keys() == {"deflections", "forces", "motors"}
    for kind, error in errors.items():
        assert error < max(2.0 * estimate[kind], 2e-6), kind
    assert max(estimate.values()) < (1e-3 if start == "static" else 0.3)


def test_links_with_eigenmodes_alone_are_not_judged_by_fewer_of_them():
    """Ten modes are off by percents here, seven of them with the static shapes of the ten hardly more."""
    assert modal_errors(arm({"count": 10, "attachment_modes": False}, "static")) is None
