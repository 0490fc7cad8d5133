"""Many numbers at once: the lightest cantilever in segments, against its closed form."""

import numpy as np
import pytest
import tomli_w
from beam_links import beam_link, rectangle

import ffrobot

LENGTH, WIDTH, FORCE = 0.8, 0.02, 1.0
E, RHO, DEFLECTION = 70e9, 2700.0, 2e-4
LOW, HIGH = 0.004, 0.04


def flexibility(segments):
    """c_k of the tip's deflection Σ c_k/h_k³ under the force there, by the heights h_k of the segments."""
    from_tip = np.linspace(LENGTH, 0.0, segments + 1)  # of the segments' ends
    return 12.0 * FORCE / (E * WIDTH) * (from_tip[:-1] ** 3 - from_tip[1:] ** 3) / 3.0


def segment(k, segments):
    return beam_link(
        LENGTH / segments,
        rectangle(0.012, WIDTH),
        1,
        E=E,
        nu=0.3,
        rho=RHO,
        name=f"s{k}",
        modes={"count": 2, "family": "in-plane-bending"},
        damping={"ratio": 0.01},
    )


def weld(k):
    return {"name": f"j{k}", "type": "weld", "between": [f"s{k - 1}.tip" if k else "ground", f"s{k}.root"]}


def stepped(segments):
    return {
        "name": "stepped",
        "gravity": [0.0, 0.0],
        "body": [{"name": f"s{k}", "link": segment(k, segments)} for k in range(segments)],
        "joint": [weld(k) for k in range(segments)],
        "load": [{"point": f"s{segments - 1}.tip", "y": str(FORCE)}],
        "initial": {"state": "static", "angles": {f"s{k}": 0.0 for k in range(segments)}},
        "analysis": [{"name": "still", "kind": "static"}],
    }


@pytest.mark.nightly
@pytest.mark.parametrize("segments", [3, 8])
def test_lightest_stepped_cantilever(tmp_path, segments):
    """Σ h is least with Σ c/h³ = δ at h_k = c_k^¼ (Σ c^¼/δ)^⅓ (Svanberg 1987, with five segments)."""
    path = tmp_path / "scene.toml"
    path.write_text(tomli_w.dumps(stepped(segments)), encoding="utf-8")
    vary = [f"links.s{k}.geometry.section.height={LOW}:{HIGH}:log" for k in range(segments)]
    limit = f"peak points.s{segments - 1}.tip.position[1] <= {DEFLECTION}"
    found = ffrobot.optimise(path, vary, minimise="mass", subject_to=[limit])
    roots = flexibility(segments) ** 0.25
    best = roots * (roots.sum() / DEFLECTION) ** (1.0 / 3.0)
    np.testing.assert_allclose(found.values, best, rtol=1e-4)
    assert found.value == pytest.approx(RHO * LENGTH / segments * WIDTH * best.sum(), rel=1e-6)
    assert found.limits[0] <= DEFLECTION * (1.0 + 1e-6)
    assert found.prices[0] == pytest.approx(-found.value / (3.0 * DEFLECTION), rel=1e-3)
    assert found.converged
    assert found.runs <= 150
