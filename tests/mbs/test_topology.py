"""Spanning forests of joints: what carries each body, and which joints close loops."""

import pytest
from mechanisms import checked_scene, revolute

from ffrobot.mbs.scene.topology import Edge, spanning_forest


def forest(bodies, *sides, slides=()):
    return spanning_forest(bodies, [Edge(between, int(k in slides)) for k, between in enumerate(sides)])


def carried(topology):
    """Own side and other side by body; None of roots."""
    return {body: carrier and (carrier.own, carrier.other) for body, carrier in topology.carriers.items()}


def test_chain_listed_backwards_goes_outwards_from_the_ground():
    topology = forest(["c", "b", "a"], ("b.tip", "c.root"), ("a.tip", "b.root"), ("a.root", "ground"))
    assert list(topology.carriers) == ["a", "b", "c"]
    assert carried(topology) == {
        "a": ("a.root", "ground"),
        "b": ("b.root", "a.tip"),
        "c": ("c.root", "b.tip"),
    }
    assert [carrier.joint for carrier in topology.carriers.values()] == [2, 1, 0]
    assert topology.is_open_chain


def test_a_body_may_carry_several():
    topology = forest(
        ["hub", "left", "right", "finger"],
        ("ground", "hub.root"), ("hub.a", "left.root"), ("hub.b", "right.root"), ("left.tip", "finger.root"),
    )  # fmt: skip
    assert {body: carrier.parent for body, carrier in topology.carriers.items()} == {
        "hub": "ground",
        "left": "hub",
        "right": "hub",
        "finger": "left",
    }
    assert topology.loop_joints == ()


def test_a_loop_has_one_joint_beside_the_tree():
    four_bar = (
        ("ground", "crank.root"),
        ("crank.tip", "rod.root"),
        ("rod.tip", "rocker.tip"),
        ("ground", "rocker.root"),
    )
    topology = forest(["crank", "rod", "rocker"], *four_bar)
    assert topology.loop_joints == (3,)
    assert topology.carriers["rocker"] == (2, "rocker.tip", "rod.tip")


def test_loops_twice_to_the_ground_and_between_two_bodies():
    topology = forest(["a", "b"], ("ground", "a.root"), ("ground", "a.tip"), ("a.tip", "b.root"), ("b.tip", "a.mid"))
    assert carried(topology) == {"a": ("a.root", "ground"), "b": ("b.root", "a.tip")}
    assert topology.loop_joints == (1, 3)
    assert not topology.is_open_chain


def test_joints_that_slide_come_last():
    """The slider hangs from the rod, although the rail is listed first."""
    topology = forest(
        ["crank", "rod", "slider"],
        ("ground", "slider.pin"), ("ground", "crank.root"), ("crank.tip", "rod.root"), ("rod.tip", "slider.pin"),
        slides=(0,),
    )  # fmt: skip
    assert carried(topology)["slider"] == ("slider.pin", "rod.tip")
    assert topology.loop_joints == (0,)


def test_what_floats_is_a_tree_of_its_own():
    topology = forest(["a", "x", "y", "z"], ("x.tip", "y.root"), ("y.tip", "z.root"), ("ground", "a.root"))
    assert carried(topology) == {
        "a": ("a.root", "ground"),
        "x": None,
        "y": ("y.root", "x.tip"),
        "z": ("z.root", "y.tip"),
    }
    assert topology.is_open_chain


@pytest.mark.parametrize(("closed", "driven"), [(False, ["O", "A"]), (True, [])])
def test_motors_are_in_all_joints_of_open_chains(closed, driven):
    joints = [revolute("O", "ground", "a.root"), revolute("A", "a.tip", "b.root")]
    scene = checked_scene(joints + [revolute("B", "b.tip", "ground", at=(1.0, 0.0))] * closed, bodies=("a", "b"))
    assert [joint.name for joint in scene.motor_joints] == driven
