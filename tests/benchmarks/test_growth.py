"""How the time of an evaluation grows with modes per link and with links in a chain, open and closed.

    .venv/bin/python -m pytest tests/benchmarks/test_growth.py --benchmark-enable -s

prints a table of minima; linear growth means that the last column settles. Links are simply supported beams with sine
modes, in closed form, so that any number of them is at hand. In the ordinary test run each size is evaluated once, and
its multipliers are checked.
"""

import time
from pathlib import Path
from types import MappingProxyType

import numpy as np
import pytest

from ffrobot.mbs import _core
from ffrobot.mbs.analysis_records import Analysis
from ffrobot.mbs.model import Assembly, build_model
from ffrobot.mbs.planar_body import PlanarBody, PlanarPoint
from ffrobot.mbs.scene_records import Scene

MASS, LENGTH, STIFFNESS = 1.0, 1.0, 100.0  # kg, m, EI in N·m²
MODES, LINKS = (2, 5, 10, 20, 50, 100, 200), (2, 5, 10, 20, 50)


def sine_link(name, modes):
    """φ_k = √(2/m) sin(kπx/L)."""
    k = np.arange(1, modes + 1)
    amplitude, sign = np.sqrt(2 / MASS), (-1.0) ** k
    rows = np.zeros((2, modes))
    slope = amplitude * k * np.pi / LENGTH
    none = np.zeros((modes, modes))
    return PlanarBody(
        name=name,
        mass=MASS,
        inertia=MASS * LENGTH**2 / 3,
        first_moment=np.array([MASS * LENGTH / 2, 0.0]),
        stiffness=STIFFNESS * LENGTH / MASS * (k * np.pi / LENGTH) ** 4,
        damping=none,
        S_bar=np.array([np.zeros(modes), MASS * amplitude * (1 - sign) / (k * np.pi)]),
        h=-MASS * amplitude * LENGTH * sign / (k * np.pi),
        j=np.zeros(modes),
        S_tilde=none,
        m_xy=np.eye(modes),
        points=MappingProxyType(
            {
                "root": PlanarPoint(np.zeros(2), rows, slope),
                "tip": PlanarPoint(np.array([LENGTH, 0.0]), rows, slope * sign),
            }
        ),
        modal_transform=np.eye(modes),
        length=LENGTH,
    )


def chain(links, modes, closed):
    """A half circle of links; its last tip on a path, or pinned to the ground besides a driven first joint."""
    bodies = [sine_link(f"b{i}", modes) for i in range(links)]
    angles = {body.name: np.pi * (i + 0.5) / links for i, body in enumerate(bodies)}
    tip = sum(np.array([np.cos(a), np.sin(a)]) * LENGTH for a in angles.values())
    names = ["ground", *(f"b{i}.tip" for i in range(links - 1))]
    joints = [
        {"name": f"j{i}", "type": "revolute", "between": (before, f"b{i}.root")} for i, before in enumerate(names)
    ]
    last = f"b{links - 1}.tip"
    if closed:
        joints.append({"name": "end", "type": "revolute", "between": ("ground", last), "at": tuple(map(float, tip))})
        path = {"name": "crank", "angle": "b0", "value": f"{angles['b0']!r}+0.1*t"}
    else:
        path = {"name": "tip", "point": last, "x": f"{tip[0]!r}+0.1*t", "y": f"{tip[1]!r}"}
    scene = Scene(
        name="growth",
        gravity=(0.0, -9.81),
        body=tuple({"name": b.name, "rigid": {"mass": 1.0, "inertia": 1.0, "center": (0.0, 0.0)}} for b in bodies),
        joint=tuple(joints),
        trajectory=(path,),
        initial={"angles": angles},
        analysis=(Analysis(name="inverse", kind="pcid", end=1.0, output_step=0.1),),
        path=Path("scene.toml"),
        text="",
    )
    model = build_model(scene, bodies)
    assembly = Assembly(model, [*model.joints, *model.trajectories])
    q = np.zeros(assembly.system.coordinates)
    at = np.zeros(2)
    for first, angle in zip(assembly.first, angles.values(), strict=True):
        q[first : first + 3] = *at, angle
        at = at + np.array([np.cos(angle), np.sin(angle)]) * LENGTH
    return assembly, q, np.zeros_like(q)


def microseconds(assembly, q, v, enabled):
    rounds, count = (15, max(20, 200_000 // len(q))) if enabled else (1, 1)
    times = []
    for _ in range(rounds):
        began = time.perf_counter()
        _core.time_evaluations(assembly.system, 0.0, q, v, count)
        times.append((time.perf_counter() - began) / count)
    return 1e6 * min(times)


@pytest.mark.parametrize("closed", [False, True], ids=["open", "closed"])
def test_growth_with_links(benchmark, closed):
    table(benchmark, "links", LINKS, [chain(links, 5, closed) for links in LINKS])


def test_growth_with_modes(benchmark):
    table(benchmark, "modes", MODES, [chain(2, modes, False) for modes in MODES])


def table(benchmark, what, sizes, cases):
    for assembly, q, v in cases:
        a, lambda_ = assembly.system.evaluate(0.0, q, v)
        assert np.all(np.isfinite(lambda_))
        C_q = assembly.system.constraints(0.0, q, v)[2]
        assert np.abs(C_q @ a).max() < 1e-6 * np.abs(C_q).max() * np.abs(a).max()  # at rest: Ċ_q q̇ = 0, targets uniform
    times = [microseconds(*case, benchmark.enabled) for case in cases]
    benchmark.pedantic(lambda: None, rounds=1)
    benchmark.extra_info |= {f"{what} {size}": value for size, value in zip(sizes, times, strict=True)}
    print()
    for size, value in zip(sizes, times, strict=True):
        print(f"{size:4d} {what}: {value:9.2f} µs, {1e3 * value / size:7.1f} ns each")
