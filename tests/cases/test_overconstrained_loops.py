"""Loops that links have to bend for, as straight ones close them by chance: Bennett's linkage, a four-bar in 3D.

Rigid links leave some of their constraints redundant; bent ones seem to lock all joints. What moves is the links.
"""

import numpy as np
import pytest
from beam_links import beam_link, rectangle
from four_bar import LENGTHS, SIDES, closed, in_3d
from tables_3d import Z, joint, pin, planar, revolute, rigid, scene, solved

import ffrobot

ALPHA, BETA, A = 0.6, 1.1, 0.3  # twists of Bennett's links, and the length of the first
B = A * np.sin(BETA) / np.sin(ALPHA)
FACTOR = np.sin((BETA + ALPHA) / 2) / np.sin((BETA - ALPHA) / 2)  # tan(first/2) tan(second/2)
END = 0.1
ANALYSES = [
    {"name": "inverse", "kind": "pcid", "end": END, "output_step": END / 400, "tolerance": 1e-6},
    {"name": "again", "kind": "forward", "actuation": "inverse", "apply": "joints", "tolerance": 1e-6},
]


def second(first):
    """The angle after a joint of that angle (Bennett, 1903)."""
    return 2 * np.arctan2(FACTOR, np.tan(first / 2))


def bennett(flexible, start=1.0):
    """Two links of length A and twist ALPHA; one of B, BETA between them, another on the ground."""
    axis = lambda twist: [0.0, -float(np.sin(twist)), float(np.cos(twist))]  # noqa: E731
    lengths = {"l1": A, "l2": B, "l3": A}
    bodies = [
        {"name": name, "link": beam_link(length, rectangle(0.02, 0.03), 4, modes={"count": 4}, damping={"ratio": 0.02})}
        if name in flexible
        else rigid(name, 0.5, [0.002, 0.01, 0.01], [length / 2, 0.02, 0.01], tip=[length, 0.0, 0.0])
        for name, length in lengths.items()
    ]
    joints = [
        revolute("J1", "ground", "l1.root", Z, motor=True),
        revolute("J2", "l1.tip", "l2.root", axis(ALPHA), rpy=[ALPHA, 0.0, 0.0], motor=False),
        revolute("J3", "l2.tip", "l3.root", axis(BETA), rpy=[BETA, 0.0, 0.0], motor=False),
        revolute("J4", "l3.tip", "ground", axis(ALPHA), rpy=[ALPHA + BETA, 0.0, 0.0], at=[-B, 0.0, 0.0], motor=False),
    ]
    q = [start, second(start), 2 * np.pi - start, 2 * np.pi - second(start)]
    guess = {joint["name"]: float(value) for joint, value in zip(joints, q, strict=True)}
    path = {"name": "turn", "joint": "J1", "value": f"{start} + 0.3*(1 - cos({np.pi / END}*t))"}
    keys = {"initial": {"joints": guess}, "trajectory": [path]}
    return scene(bodies, joints, *ANALYSES, gravity=[1.0, 2.0, -9.0], **keys)


def balanced(run, analysis, motor):
    """Work of the motor, change of energy, dissipation: what is left, and how large they are, J."""
    time = run[f"{analysis}/time"]
    power = run[f"{analysis}/joints/{motor}/moment"] * run[f"{analysis}/joints/{motor}/rate"]
    power = power - run[f"{analysis}/energy/dissipated_power"]
    energy = sum(run[f"{analysis}/energy/{part}"] for part in ("kinetic", "strain", "gravitational"))
    way = np.diff(time) @ (power[1:] + power[:-1]) / 2
    return abs(energy[-1] - energy[0] - way), np.ptp(energy)


@pytest.mark.parametrize("flexible", [(), ("l2",), ("l1", "l2", "l3")], ids=["rigid", "one", "all"])
def test_bennetts_linkage(flexible):
    """Angles of the closed form, to the deflection of links; torques that move it alike."""
    with ffrobot.solve(ffrobot.make_scene(**bennett(flexible))) as run:
        q = [run[f"inverse/joints/J{k}/coordinate"] for k in (1, 2, 3, 4)]
        expected = [q[0], second(q[0]), 2 * np.pi - q[0], 2 * np.pi - second(q[0])]
        off = np.abs(np.angle(np.exp(1j * (np.array(q) - expected)))).max()
        assert off < (5e-3 if flexible else 1e-9)
        left, size = balanced(run, "inverse", "J1")
        assert left < 1e-4 * size
        np.testing.assert_allclose(run["again/joints/J1/coordinate"], q[0], atol=1e-5)
        assert not any("singular" in text for texts in run.warnings.values() for text in texts)


def reactions(run, analysis="free"):
    return [run[f"{analysis}/joints/J{k}/{part}"] for k in (1, 2, 3, 4) for part in ("reaction", "reaction_moment")]


@pytest.mark.parametrize("integrator", ["dop853", "radau"])
def test_a_rigid_linkage_turns_over(integrator):
    """Over full turns each constraint equation depends on others somewhere, and is needed elsewhere.

    The least split of reactions does not depend on where the loop is cut.
    """
    tables = bennett(())
    tables |= {"trajectory": [], "initial": tables["initial"] | {"joint_rates": {"J1": 12.0}}}
    free = {"name": "free", "kind": "forward", "end": 1.5, "output_step": 0.01, "tolerance": 1e-8}
    tables["analysis"] = [free | {"integrator": integrator}]
    with solved(tables) as run:
        q = [run[f"free/joints/J{k}/coordinate"] for k in (1, 2)]
        kinetic = run["free/energy/kinetic"]
        energy = kinetic + run["free/energy/gravitational"]
        found = reactions(run)
    assert np.ptp(q[0]) > 2 * np.pi
    assert np.abs(np.angle(np.exp(1j * (q[1] - second(q[0]))))).max() < 1e-9
    assert np.ptp(energy) < 1e-7 * np.ptp(kinetic)
    with solved(tables | {"joint": tables["joint"][::-1]}) as run:
        for one, other in zip(found, reactions(run), strict=True):
            np.testing.assert_allclose(other, one, atol=1e-5 * np.abs(one).max())


def test_two_outputs_tell_no_turns():
    """By the rates at both ends joint 4, at which the loop is cut, has turned once less than it has."""
    tables = bennett(()) | {"trajectory": []}
    tables["initial"] |= {"joint_rates": {"J1": 12.0}}
    tables["analysis"] = [{"name": "free", "kind": "forward", "end": 1.5, "output_step": 1.5, "tolerance": 1e-6}]
    with solved(tables) as run:
        assert any('"J4": outputs are too far apart' in text for text in run.warnings["free"])


def test_two_pins_hold_as_a_weld():
    """In the plane: a turning bar, to which another one is pinned at both ends, with a third at its end."""
    found = []
    for is_welded in (True, False):
        bodies = [
            {"name": name, "rigid": {"mass": mass, "center": [0.2, 0.0], "inertia": 0.01, "points": points}}
            for name, mass in (("a", 1.0), ("b", 0.7), ("c", 0.3))
            for points in [{"root": [0.0, 0.0], "tip": [0.5, 0.0]}]
        ]
        joints = [pin("j", "ground", "a.root"), pin("e", "b.tip", "c.root")]
        joints += [joint("k", "weld", "a.root", "b.root")] if is_welded else [
            pin("k", "a.root", "b.root"), pin("l", "a.tip", "b.tip")
        ]  # fmt: skip
        run = {"name": "free", "kind": "forward", "end": 2.0, "output_step": 0.1, "tolerance": 1e-9}
        start = {"joints": {"j": 0.3, "e": 0.4}, "joint_rates": {"j": 5.0}}
        with solved(planar(bodies, joints, run, initial=start)) as results:
            found.append([results[f"free/joints/{name}"] for name in ("j/coordinate", "e/coordinate", "e/reaction")])
    for one, two in zip(*found, strict=True):
        np.testing.assert_allclose(two, one, atol=1e-6 * np.abs(one).max())


def four_bar(across, *analyses, is_rigid=False):
    """Flexible bars, or rigid ones of their mass, under gravity with a component `across` their plane."""
    tables = in_3d({name: {"motor": name == "A"} for name in SIDES}, list(analyses))
    modes = {"count": 4, "attachment_modes": False}
    links = {name: beam_link(L, rectangle(0.02, 0.02), 4, modes=modes) for name, L in LENGTHS.items()}
    tables |= {"body": [{"name": name, "link": link} for name, link in links.items()]}
    if is_rigid:
        masses = {name: 2700.0 * 0.02**2 * length for name, length in LENGTHS.items()}
        tables["body"] = [
            rigid(name, m, [m * L**2 / 12] * 3, [L / 2, 0.0, 0.0], tip=[L, 0.0, 0.0])
            for (name, m), L in zip(masses.items(), LENGTHS.values(), strict=True)
        ]
    tables |= {"gravity": [0.0, -9.81, across], "initial": {"joints": closed(1.0), "state": "static"}}
    return ffrobot.solve(ffrobot.make_scene(**tables))


def test_what_links_in_such_loops_cannot_do_is_told():
    """Their shape cannot be prescribed; control needs the freedom that the linkage has with straight links."""
    times = {"end": 0.02, "output_step": 0.001}
    with pytest.raises(ffrobot.SolveError, match='"D" closes are redundant with straight links'):
        four_bar(-5.0, {"name": "shape", "kind": "fcid", "shape": "static"} | times)
    torque = {"name": "torque", "kind": "closed-loop", "actuation": "inverse", "feed_forward": "none", "delay": 0.0}
    torque |= {"sample_time": 0.001, "controller": [{"kind": "computed-torque", "bandwidth": 10.0}]}
    with four_bar(-5.0, ANALYSES[0] | times, torque) as run:
        first = run["torque/joints/A/moment"][0]
    with four_bar(-5.0, ANALYSES[0] | times, is_rigid=True) as run:
        assert first == pytest.approx(run["inverse/joints/A/moment"][0], rel=1e-6)
