"""Scenes of one link in the plane."""

from ffrobot.scene.load import make_scene


def one_link(name, link, *analyses, joint=None, **keys):
    """Welded to the ground, or on a revolute joint "O" with these keys; no gravity, unless `keys` of the scene say so.

    With `target` the joint follows it.
    """
    target = keys.pop("target", None)
    of_joint = {"name": "O", "type": "weld" if joint is None else "revolute", "between": ["ground", f"{name}.root"]}
    path = [] if target is None else [{"name": "path", "joint": "O", "value": target}]
    scene = {
        "name": name, "gravity": [0.0, 0.0], "body": [{"name": name, "link": link}], "trajectory": path,
        "joint": [of_joint | (joint or {})], "analysis": list(analyses),
    }  # fmt: skip
    return make_scene(**(scene | keys))
