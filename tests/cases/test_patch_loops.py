"""Patches in two planes of one link as sensors and as dampers: closed forms of a held cantilever."""

import numpy as np
import pytest
from beam_links import beam_link, rectangle
from tables_3d import ORIGIN, revolute, scene

import ffrobot
from ffrobot.common.errors import InputError

ROD = beam_link(
    0.6, rectangle(0.006, 0.006), 24, nu=None, name="rod",
    modes={ "count": 4, "family": ["in-plane-bending", "out-of-plane-bending"]}
)  # fmt: skip
SIDE = {
    "body": "rod", "count": 4, "length": 0.06, "width": 0.006, "thickness": 0.3e-3, "modulus": 63e9, "d31": 110e-12,
    "structural": False, "allocation": "least-squares",
}  # fmt: skip
FLAT = SIDE | {"name": "flat"}
EDGE = SIDE | {"name": "edge", "bends": "out-of-plane", "count": 3}
ZETA = 0.03


def solved(*analyses):
    still = {"name": "still", "kind": "fcid", "shape": "zero", "end": 0.6, "output_step": 5e-4}
    hub, path = (
        revolute("hub", "ground", "rod.root", rotor_inertia=1e5),
        {"name": "still", "joint": "hub", "value": "0"},
    )
    tables = scene([{"name": "rod", "link": ROD}], [hub], still, *analyses, gravity=ORIGIN, trajectory=[path])
    return ffrobot.solve(ffrobot.make_scene(**tables, pzt=[FLAT, EDGE]))


def loop(**keys):
    """Hit at the tip, aslant, for 2 ms."""
    hit = {"point": "rod.tip", "y": "where(t < 0.002, 5, 0)", "z": "where(t < 0.002, -8, 0)"}
    found = {"name": "loop", "kind": "closed-loop", "actuation": "still", "sample_time": 5e-4, "disturbance": [hit]}
    return found | {"tip": "rod.tip", "tolerance": 1e-6} | keys


def modal(found, ending=""):
    """(K, 8) at samples."""
    outputs = list(found.attributes("loop/control")["outputs"])
    return found["loop/control/readings"][:, [outputs.index(f"modal/rod/{k}{ending}") for k in range(1, 9)]]


def test_patches_in_two_planes_damp_both_as_much_as_they_are_asked_to():
    """Amplitudes √(p² + (ṗ/ω)²) decay as exp(−ζωt): the two lowest modes in each plane, the others not at all."""
    damper = {"kind": "modal-velocity", "bodies": ["rod"], "modes": 4, "damping_ratio": ZETA, "sensor": "ideal"}
    linear = {"name": "linear", "kind": "linear", "about": "still", "times": [0.0]}
    with solved(linear, loop(controller=[damper], sensor=[{"modal": "rod"}])) as found:
        inputs = list(found.attributes("loop/control")["inputs"])
        assert inputs[1:] == [f"pzt/{name}/{k}" for name, n in (("flat", 4), ("edge", 3)) for k in range(1, n + 1)]
        t, omega = found["loop/control/time"], 2 * np.pi * found["linear/linear/frequency"][0][1:]
        amplitude = np.hypot(modal(found), modal(found, "/rate") / omega)
        for k, until in zip(range(4), (0.6, 0.6, 0.2, 0.2), strict=True):
            ring = (t > 0.01) & (t < until)
            assert -np.polyfit(t[ring], np.log(amplitude[ring, k]), 1)[0] / omega[k] == pytest.approx(ZETA, rel=0.02)
        for k in (4, 5):
            assert amplitude[-1, k] > 0.8 * amplitude[40, k]


def test_what_patches_read_is_what_they_would_do_with_a_volt():
    """Charge of a motion is the modal force per volt of it (Lee and Moon 1990), over the capacitance, by layout."""
    sensor = [{"pzt": "flat", "capacitance": 2e-8}, {"pzt": "edge", "capacitance": 5e-8}, {"modal": "rod"}]
    linear = {"name": "linear", "kind": "linear", "about": "still", "times": [0.0]}
    with solved(linear, loop(sensor=sensor)) as found:
        (model,) = found.linear("linear")
        outputs = list(found.attributes("loop/control")["outputs"])
        coordinates = [model.state_names.index(f"modal/rod/{k}") for k in range(1, 9)]
        for name, count, capacitance in (("flat", 4, 2e-8), ("edge", 3, 5e-8)):
            patches = [f"pzt/{name}/{k}" for k in range(1, count + 1)]
            volts = found["loop/control/readings"][:, [outputs.index(patch) for patch in patches]]
            forces = (model.mass @ model.B[model.freedom :, model.inputs(patches)])[coordinates]
            expected = modal(found) @ forces / capacitance
            assert (np.abs(volts).max(axis=0) > 1.0).all()
            np.testing.assert_allclose(volts, expected, atol=1e-9 * np.abs(expected).max())


def test_layouts_are_named():
    with pytest.raises(InputError, match='pzt: expected one of the layouts "flat", "edge", found "rod"'):
        solved(loop(sensor=[{"pzt": "rod"}]))
