"""Joints of planar scenes: which there are, and what a weld has none of."""

import pytest
from mechanisms import checked_scene, revolute

from ffrobot.common.errors import InputError
from ffrobot.scene.load import make_scene


def test_types_of_the_plane_are_told():
    with pytest.raises(
        InputError, match=r'joint "S": type: expected "revolute", "prismatic"( or|,) "weld", found "slit"'
    ):
        checked_scene([{"name": "S", "between": ["ground", "a.root"], "type": "slit"}])
    with pytest.raises(InputError, match=r'joint "S": wy: expected one of the keys'):
        checked_scene([{"name": "S", "between": ["ground", "a.root"], "type": "revolute", "wy": 1.0}])


@pytest.mark.parametrize("key", ["moment_limit", "gear_ratio", "rotor_inertia", "viscous_friction"])
def test_a_weld_has_no_keys_of_motors(key):
    with pytest.raises(InputError, match=f'"{key}" only in revolute or prismatic joints, found it in a weld joint'):
        checked_scene([{"name": "W", "type": "weld", "between": ["ground", "a.root"], key: 1.0}])


def test_a_weld_has_no_coordinate_for_trajectories_and_loads():
    rigid = {"mass": 1.0, "inertia": 1.0, "center": [0.0, 0.0], "points": {"root": [0.0, 0.0], "tip": [1.0, 0.0]}}
    with pytest.raises(InputError) as caught:
        make_scene(
            name="weld",
            gravity=[0.0, 0.0],
            body=[{"name": "a", "rigid": rigid}, {"name": "b", "rigid": rigid}],
            joint=[revolute("O", "ground", "a.root"), {"name": "W", "type": "weld", "between": ["a.tip", "b.root"]}],
            trajectory=[{"name": "turn", "joint": "W", "value": "t"}],
            load=[{"joint": "W", "moment": 1.0}],
            analysis=[{"name": "run", "kind": "pcid", "end": 1.0, "output_step": 0.1}],
        )
    lines = str(caught.value).splitlines()
    for key in ('trajectory "turn": joint', "load no. 1: joint"):
        assert any(f'{key}: expected a joint that moves ("O"), found "W", a weld' in line for line in lines)
