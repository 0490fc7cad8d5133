"""Rigid rods, and a slider-crank of them."""

from mechanisms import make_model, revolute

from ffrobot.mbs.model.planar_body import from_rigid_body
from ffrobot.mbs.scene.bodies import RigidBody


def rod(name, length, mass):
    points = {"root": (0.0, 0.0), "tip": (length, 0.0)}
    body = RigidBody(mass=mass, inertia=mass * length**2 / 12, center=(length / 2, 0.0), points=points)
    return from_rigid_body(name, body)


def slider_crank(path, **keys):
    joints = [
        revolute("O", "ground", "crank.root", motor=True),
        revolute("A", "crank.tip", "rod.root"),
        revolute("B", "rod.tip", "slider.pin"),
        {"name": "rail", "type": "prismatic", "between": ("ground", "slider.pin"), "axis": (1.0, 0.0)},
    ]
    slider = from_rigid_body("slider", RigidBody(mass=0.4, inertia=0.01, center=(0.0, 0.0), points={"pin": (0.0, 0.0)}))
    bodies = [rod("crank", 0.2, 1.0), rod("rod", 0.5, 1.5), slider]
    initial = {"angles": {"crank": 0.9, "rod": -0.3}}
    return make_model(bodies, joint=joints, trajectory=[path], initial=initial, **keys)
