"""URDF as text (wiki.ros.org/urdf/XML): links and joints of a `Robot`, and simple shapes to see them by."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from xml.etree import ElementTree

from .robot import Inertial, Origin, Primitive, Robot, UrdfJoint

Element = ElementTree.Element


def urdf_text(robot: Robot, visuals: Mapping[str, Sequence[Primitive]]) -> str:
    """The file, numbers with all their digits; `visuals` by link, in axes of the link."""
    root = Element("robot", name=robot.name)
    for link in robot.links.values():
        element = ElementTree.SubElement(root, "link", name=link.name)
        if link.inertial is not None:
            _add_inertial(element, link.inertial)
        for visual in visuals.get(link.name, ()):
            _add_visual(element, visual)
    for joint in robot.joints.values():
        _add_joint(root, joint)
    ElementTree.indent(root)
    return '<?xml version="1.0"?>\n' + ElementTree.tostring(root, encoding="unicode") + "\n"


def _add(parent: Element, tag: str, **values: float | str) -> Element:
    return ElementTree.SubElement(
        parent, tag, {key: value if isinstance(value, str) else repr(float(value)) for key, value in values.items()}
    )


def _triple(values: Sequence[float]) -> str:
    return " ".join(repr(float(value) + 0.0) for value in values)  # no −0.0


def _add_origin(parent: Element, origin: Origin) -> None:
    if any(origin.xyz) or any(origin.rpy):
        _add(parent, "origin", xyz=_triple(origin.xyz), rpy=_triple(origin.rpy))


def _add_inertial(link: Element, inertial: Inertial) -> None:
    element, J = _add(link, "inertial"), inertial.inertia
    x, y, z = inertial.center
    _add_origin(element, Origin((float(x), float(y), float(z))))
    _add(element, "mass", value=inertial.mass)
    _add(element, "inertia", ixx=J[0, 0], ixy=J[0, 1], ixz=J[0, 2], iyy=J[1, 1], iyz=J[1, 2], izz=J[2, 2])


def _add_visual(link: Element, visual: Primitive) -> None:
    element = _add(link, "visual")
    _add_origin(element, visual.origin)
    geometry = _add(element, "geometry")
    if visual.shape == "box":
        _add(geometry, "box", size=_triple(visual.size))
    elif visual.shape == "cylinder":
        _add(geometry, "cylinder", radius=visual.size[0], length=visual.size[1])
    else:
        _add(geometry, "sphere", radius=visual.size[0])


def _add_joint(root: Element, joint: UrdfJoint) -> None:
    element = _add(root, "joint", name=joint.name, type=joint.type)
    _add_origin(element, joint.origin)
    _add(element, "parent", link=joint.parent)
    _add(element, "child", link=joint.child)
    if joint.type not in ("fixed", "floating"):
        _add(element, "axis", xyz=_triple(joint.axis))
    for tag, values in (("limit", joint.limits), ("dynamics", joint.dynamics)):
        if values:
            _add(element, tag, **values)
    if (mimic := joint.mimic) is not None:
        _add(element, "mimic", joint=mimic.joint, multiplier=mimic.multiplier, offset=mimic.offset)
