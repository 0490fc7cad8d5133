"""Motors that turn sections and frames: what they share; how many there have to be."""

import numpy as np
import pytest
import zoo
from mechanisms import pcid, relative
from oracle_runs import evaluated, posture_of, run

from ffrobot.common.errors import InputError


def test_motors_at_frames_and_sections_share_moments_and_differ_in_modal_forces():
    """With p held, sections and frames turn alike, so τ is the same; the reactions bend the links only at sections."""
    at_sections, robot = zoo.build("chain of 2"), zoo.build("chain of 2", motors="frame")
    section, in_tree = evaluated(at_sections, 0.0, *posture_of(at_sections, np.random.default_rng(0))), []
    for of_bodies, in_section in ((section.q[0], section.outcome.q[0]), (section.v[0], section.outcome.v[0])):
        turns = [of_bodies[section.coordinates(name)][2] for name in ("b1", "b2")]
        moved = in_section.copy()  # frames turn against each other by the coordinates of these motors
        moved[[robot.model.columns(joint)[0] for joint in ("j1", "j2")]] = turns[0], turns[1] - turns[0]
        in_tree.append(moved)
    frame = evaluated(robot, 0.0, *in_tree)
    assert relative(frame.q, section.q) < 1e-12
    assert relative(frame.tau[0], section.tau[0]) < 1e-12
    assert relative(frame.F_p[0], section.F_p[0]) > 1e-2


def test_too_few_named_motors_are_refused():
    joints = zoo.serial_joints(2)
    joints[0]["motor"], joints[1]["motor"] = True, False
    with pytest.raises(InputError, match=r"as many motors as the mechanism has degrees of freedom \(2\), found 1"):
        run(zoo.build("chain of 2", joint=joints), pcid())
