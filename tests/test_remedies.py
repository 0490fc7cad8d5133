"""What messages advise is tried: each remedy that a text names makes the text disappear, and the scene is solved."""

import re

import pytest
from beam_links import beam_link, rectangle
from tables_3d import pin

from ffrobot.common.errors import InputError, SolveError
from ffrobot.results.file import Results
from ffrobot.results.write import results_image
from ffrobot.run.solve import solve_scene
from ffrobot.run.watcher import Watcher
from ffrobot.scene.load import make_scene

END = 0.5
RISE = f"(10*(t/{END})**3 - 15*(t/{END})**4 + 6*(t/{END})**5)"
PCID = {"name": "run", "kind": "pcid", "end": END, "output_step": 0.01}
FORWARD = PCID | {"kind": "forward"}
STATIC = {"name": "rest", "kind": "static"}
BENT = {"joints": {"s": 0.9, "e": -1.2}}


def rod(name, length, mass=1.0):
    points = {"root": [0.0, 0.0], "tip": [length, 0.0]}
    return {"name": name, "rigid": {"mass": mass, "inertia": mass * length**2 / 3, "center": [length / 2, 0.0]} | {
        "points": points}}  # fmt: skip


def tip(x, y="0.2"):
    return [{"name": "tip", "point": "b.tip", "x": x, "y": y}]


def joints(s, **keys):
    """The first joint moves by a law, the other one stays."""
    of_s = {"value": s} if isinstance(s, str) else {"via": s, "duration": 0.3}
    return [{"name": "s", "joint": "s"} | of_s | keys, {"name": "e", "joint": "e", "value": "0.1"}]


def arm(first=None, **keys):
    """Two rods in the vertical plane; `first`: keys of its first joint."""
    return {
        "name": "arm", "gravity": [0.0, -10.0], "body": [rod("a", 0.5), rod("b", 0.4)], "initial": BENT,
        "joint": [pin("s", "ground", "a.root", **(first or {})), pin("e", "a.tip", "b.root")],
        "trajectory": tip("0.6 + 0.1*sin(2*t)"), "analysis": [PCID],
    } | keys  # fmt: skip


def falling(first=None, **analysis):
    """The same without motion prescribed."""
    return arm(first, trajectory=[], analysis=[FORWARD | analysis])


def four_bar(**start):
    bars = [rod("a", 0.4), rod("b", 0.5), rod("c", 0.4)]
    between = {"s": ("ground", "a.root"), "e": ("a.tip", "b.root"), "f": ("b.tip", "c.tip"), "h": ("ground", "c.root")}
    found = [pin(name, *pair) for name, pair in between.items()]
    found[-1] |= {"at": [0.6, 0.0]}
    return arm(body=bars, joint=found, trajectory=[], analysis=[FORWARD | {"end": 0.02}], initial={"joints": start})


def loop_3d(f, h):
    """A loop of three bars in 3D with joints of these types."""
    inertia = {"inertia": [0.001, 0.02, 0.02], "center": [0.2, 0.0, 0.0]}
    bars = [
        {"name": name, "rigid": {"mass": 1.0, "points": {"root": [0.0, 0.0, 0.0], "tip": [x, 0.0, 0.0]}} | inertia}
        for name, x in (("a", 0.4), ("b", 0.5), ("c", 0.4))
    ]
    z = {"axis": [0.0, 0.0, 1.0]}
    found = [
        pin("s", "ground", "a.root", **z), pin("e", "a.tip", "b.root", **z),
        {"name": "f", "between": ["b.tip", "c.tip"], **f}, {"name": "h", "between": ["ground", "c.root"], **h},
    ]  # fmt: skip
    found[-1] |= {"at": [0.6, 0.0, 0.0]}
    return arm(
        space="spatial", gravity=[0.0, 0.0, -10.0], body=bars, joint=found, initial={"joints": {"s": 1.2}},
        trajectory=[{"name": "s", "joint": "s", "value": "1.2 + t"}],
    )  # fmt: skip


def soft(path, thick=0.002, load=0.2, rotor=0.0, body=None, **keys):
    """A flexible link; `path` is that of its joint, or of its tip."""
    link = beam_link(0.5, rectangle(thick, 0.02), 8, modes={"count": 2, "family": "in-plane-bending"})
    follows = {"name": "path", "joint": "s", "value": path} if isinstance(path, str) else {"name": "path", **path}
    return {
        "name": "soft", "gravity": [0.0, -10.0], "body": [{"name": "a", "link": link} | (body or {})],
        "joint": [pin("s", "ground", "a.root", rotor_inertia=rotor)], "trajectory": [follows],
        "payload": [{"point": "a.tip", "mass": load}] if load else [], "analysis": [PCID],
    } | keys  # fmt: skip


def sampled(step, gain):
    controller = {"kind": "joint-pid", "proportional": {"s": gain}, "derivative": {"s": gain / 10}}
    loop = {"name": "loop", "kind": "closed-loop", "actuation": "run", "sample_time": step, "controller": [controller]}
    return {"analysis": [PCID, loop]}


REVOLUTE = {"type": "revolute", "axis": [0.0, 0.0, 1.0]}
WEAK, STRONG = {"moment_limit": 9.0}, {"moment_limit": 15.0}
SLOW = {"coulomb_friction": 5.0, "friction_speed": 1e-6}
DOPRI5 = {"integrator": "dopri5", "max_steps": 2000}
LIFT = joints([0, 1], fastest=True)
LONG = [PCID | {"end": 1.5, "output_step": 0.1}]
OFF = {"point": "a.tip", "y": f"0.1*{RISE}"}
HANGING = {"joints": {"s": -1.5, "e": 0.0}}
# A text, a scene that has it, and this scene after each remedy that the text names
CASES = {
    "degrees of freedom are not prescribed": (
        arm(trajectory=joints("0.9")[:1]),
        arm(trajectory=joints("0.9")),
        arm(trajectory=joints("0.9")[:1], redundancy="least-motion"),
        arm(trajectory=joints("0.9")[:1], redundancy="least-torque"),
    ),
    "as many components: leave the key out": (arm(redundancy="least-motion"), arm()),
    "found a jump .* round it off": (
        arm(trajectory=tip("0.6 + 0.1*abs(t - 0.2)")),
        arm(trajectory=[{"name": "tip", "point": "b.tip", "via": [[0.62, 0.2], [0.6, 0.2]], "duration": 0.5}]),
        arm(trajectory=tip("0.6 + 0.1*sqrt((t - 0.2)**2 + 0.01)")),
    ),
    "found a singular one": (
        arm(trajectory=tip("0.9", "0"), initial={"joints": {"s": 0.0, "e": 0.0}}),
        arm(trajectory=tip("0.8", "0"), initial={"joints": {"s": 0.3, "e": -0.6}}),
    ),
    "too many steps": (
        falling(integrator="dopri5", max_steps=10, tolerance=1e-8),
        falling(integrator="dopri5", max_steps=1000, tolerance=1e-8),
        falling(integrator="dopri5", max_steps=10, tolerance=1e-2),
    ),
    "use .*less friction or a larger friction_speed": (
        falling(SLOW, **DOPRI5),
        falling(SLOW, **DOPRI5 | {"integrator": "radau"}),
        falling(SLOW | {"coulomb_friction": 0.005}, **DOPRI5),
        falling(SLOW | {"friction_speed": 0.1}, **DOPRI5),
    ),
    r"write where\(condition, a, b\)": (
        falling() | {"load": [{"point": "b.tip", "y": "50*(t > 0.2)"}]},
        falling() | {"load": [{"point": "b.tip", "y": "50*where(t > 0.2, 1, 0)"}]},
    ),
    "give values of as many joints as can move": (four_bar(s=1.2, e=-1.0, h=0.5), four_bar(s=1.2), four_bar(h=1.5)),
    'with state = "undeformed"': (
        falling() | {"initial": BENT | {"state": "static"}},
        falling() | {"initial": BENT | {"state": "undeformed"}},
    ),
    "start near another one": (
        arm(trajectory=[], analysis=[STATIC], initial={"joints": {"s": 1.5707963267948966, "e": 0.0}}),
        arm(trajectory=[], analysis=[STATIC], initial=HANGING),
    ),
    "joints with more degrees of freedom in loops": (
        loop_3d(REVOLUTE, REVOLUTE),
        loop_3d({"type": "spherical"}, {"type": "universal", "axis": [0, 0, 1.0], "second_axis": [0, 1.0, 0]}),
    ),
    'use kind = "pcid"': (arm(analysis=[PCID | {"kind": "motors-only"}]), arm()),
    "start and end with zero speed": (
        soft({"point": "a.tip", "y": "0.1*t"}, analysis=[PCID | {"kind": "motors-only"}]),
        soft(OFF, analysis=[PCID | {"kind": "motors-only"}]),
    ),
    'kind = "motors-only", or patches': (soft(OFF), soft(OFF, analysis=[PCID | {"kind": "motors-only"}])),
    "A later end helps": (
        arm(STRONG, trajectory=LIFT, analysis=[PCID | {"end": 0.3, "output_step": 0.1}]),
        arm(STRONG, trajectory=LIFT, analysis=LONG),
    ),
    "less load, or another motor or gear": (
        arm(WEAK, trajectory=joints([0, 1], duration=1.5), analysis=LONG),
        arm(STRONG, trajectory=joints([0, 1], duration=1.5), analysis=LONG),
        arm(WEAK, trajectory=joints([0, 1], duration=1.5), analysis=LONG, body=[rod("a", 0.5), rod("b", 0.4, 0.5)]),
    ),
    "torques at rest exceed limits: less load, or another motor": (
        arm(WEAK, trajectory=LIFT, analysis=LONG),
        arm(STRONG, trajectory=LIFT, analysis=LONG),
    ),
    "consider geometric_stiffening": (
        soft(f"0.6*{RISE}", load=0.0),
        soft(f"0.6*{RISE}", load=0.0, geometric_stiffening=True),
    ),
    "divide the link: pieces = 5": (
        soft("0.0", geometric_stiffening=True, analysis=[STATIC]),
        soft("0.0", geometric_stiffening=True, analysis=[STATIC], body={"pieces": 5}),
    ),
    "negligible rotor_inertia|loop diverges": (
        soft(f"0.1*{RISE}", 0.01, 0.0, **sampled(0.01, 200.0)),
        soft(f"0.1*{RISE}", 0.01, 0.0, 0.1, **sampled(0.001, 20.0)),
    ),
}  # fmt: skip


def said(keys, folder):
    """All texts on a scene, a line each: of the error, or of its analyses."""
    try:
        image = results_image(solve_scene(make_scene(**keys), Watcher()))
    except (InputError, SolveError) as error:
        return f"error: {error}"
    found = Results.from_image(image, folder / "x.h5").verdict.analyses
    ended = [f"error: {one.status} {one.cause}" for one in found if one.status != "completed"]
    return "\n".join([*ended, *(text for one in found for text in (*one.warnings, *one.notes, *one.advice))])


@pytest.mark.parametrize("text", CASES)
def test_each_remedy_removes_what_advises_it(text, tmp_path):
    faulty, *remedied = CASES[text]
    assert re.search(text, said(faulty, tmp_path))
    for keys in remedied:
        after = said(keys, tmp_path)
        assert not re.search(f"{text}|error: ", after), after
