"""Arms whose links have the damping ratio RATIO, of their own modes or of the robot's vibrations."""

from beam_links import beam_link

import ffrobot

RATIO = 0.01


def link(name, condition, of, section=None, **modes):
    """A steel beam of 1 m that bends in the plane, unless `modes` says otherwise."""
    return beam_link(
        1.0, section or {"shape": "rectangle", "height": 0.015, "width": 0.025}, 20, E=2.068e11, nu=0.3, rho=7850.0,
        condition=condition, name=name,
        modes=modes or {"count": 10, "family": "in-plane-bending", "attachment_modes": False},
        damping={"ratio": RATIO, "of": of}
    )  # fmt: skip


def planar_arm(conditions, of, **keys):
    """The two-link arm of docs/theory.md, Damping."""
    names = ("link1", "link2")
    return {
        "name": "arm",
        "space": "planar",
        "gravity": [0.0, 0.0],
        "body": [{"name": n, "link": link(n, c, of)} for n, c in zip(names, conditions, strict=True)],
        "joint": [
            {"name": "O", "type": "revolute", "between": ["ground", "link1.root"]},
            {"name": "A", "type": "revolute", "between": ["link1.tip", "link2.root"]},
        ],
        "payload": [{"point": "link2.tip", "mass": 2.0}],
        "initial": {"angles": {"link1": 0.4, "link2": -0.6}},
        "analysis": [{"name": "at_rest", "kind": "linear"}],
    } | keys


def vibrations_of(scene):
    """Frequencies (Hz) and damping ratios of the linear model of a scene, without rigid motion."""
    with ffrobot.solve(ffrobot.make_scene(**scene)) as results:
        frequency, ratio = (results[f"at_rest/linear/{key}"][0] for key in ("frequency", "damping_ratio"))
    return frequency[frequency > 0.0], ratio[frequency > 0.0]
