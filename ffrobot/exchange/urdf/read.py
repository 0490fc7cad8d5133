"""Reading URDF files: elements and numbers, with messages that name file, element, what was expected and found."""

from __future__ import annotations

import math
import re
from collections import Counter
from collections.abc import Iterable, Mapping, Sequence
from pathlib import Path
from xml.etree import ElementTree
from xml.parsers import expat

import numpy as np

from ...common.errors import InputError, did_you_mean, quoted
from ...common.rotations import of_rpy
from ...common.tables import LARGEST, shown
from ...common.toml_files import read_bytes
from .robot import TYPES, Inertial, MeshFile, Mimic, Numbers3, Origin, Primitive, Robot, UrdfJoint, UrdfLink, three

Element = ElementTree.Element

_ENCODING = re.compile(rb"""(?:\xef\xbb\xbf)?<\?xml[^>]*?\sencoding=["']([\w.-]+)["']""")
ONCE = {
    "inertial", "origin", "mass", "inertia", "parent", "child", "axis", "limit", "dynamics", "mimic",
}  # fmt: skip
ENTRIES = ("ixx", "iyy", "izz", "ixy", "ixz", "iyz")


def read_urdf(path: Path) -> Robot:
    """The robot in the URDF file at `path`.

    Raises:
        InputError: it cannot be read, is no URDF, an element or number is missing or wrong, links do not form one tree.
    """
    try:
        return robot_of(_root_element(read_bytes(path, "URDF file")))
    except InputError as error:
        if str(error).startswith(f"{path}:"):
            raise
        raise InputError("\n".join(f"{path}: {line}" for line in str(error).splitlines())) from None


def _root_element(content: bytes) -> Element:
    try:
        root = _parsed(content)
    except (expat.ExpatError, LookupError, ValueError) as error:
        raise InputError(f"expected a URDF file, found XML that is not well-formed: {error}") from None
    prefixes = {key.partition(":")[2] for key, value in root.items() if "ros.org/wiki/xacro" in value} | {"xacro"}
    if xacro := next((each.tag for each in root.iter() if each.tag.partition(":")[0] in prefixes), None):
        raise InputError(
            f"expected a URDF file, found <{shown(xacro)}>: run `xacro FILE.xacro > ROBOT.urdf` first,"
            " in an environment with ROS or with PyPI's xacro"
        )
    if root.tag != "robot":
        raise InputError(f"expected a URDF file, whose root is <robot>, found <{shown(root.tag)}>")
    return root


def _parsed(content: bytes) -> Element:
    """Elements with their prefixes as they are: published files use some (drake:, gazebo:) that they do not declare."""
    declared = _ENCODING.match(content)  # not in UTF-16, which expat knows
    if declared:
        content = content.decode(declared[1].decode()).encode()  # expat knows none of several bytes a character
    builder, parser = ElementTree.TreeBuilder(), expat.ParserCreate("utf-8" if declared else None)
    parser.StartElementHandler, parser.EndElementHandler = builder.start, builder.end
    parser.CharacterDataHandler = builder.data
    parser.Parse(content, True)
    return builder.close()


def robot_of(root: Element) -> Robot:
    """The robot of a <robot> element."""
    links = [_link(each) for each in root.findall("link")]
    joints = [_joint(each) for each in root.findall("joint")]
    _check_once("link", (link.name for link in links))
    _check_once("joint", (joint.name for joint in joints))
    by_name = {joint.name: joint for joint in joints}
    check_mimics(by_name)
    base = root_of([link.name for link in links], joints)
    name = root.get("name", "").strip() or base
    return Robot(name, {link.name: link for link in links}, by_name, base, (*_turned(root), *_repeated(root)))


def _turned(root: Element) -> Iterable[str]:
    """Remarks on angles of more than a turn, which are degrees as a rule."""
    for each in (*root.findall("link"), *root.findall("joint")):
        turned = each.find("inertial") if each.tag == "link" else each
        rpy = (0.0, 0.0, 0.0) if turned is None else _origin(turned, each.tag).rpy
        if max(map(abs, rpy)) > 2 * math.pi:
            angles = " ".join(f"{angle:g}" for angle in rpy)
            yield f'{each.tag} "{shown(_name(each))}": rpy {angles} is more than a turn: URDF has rad, not degrees'


def _repeated(root: Element) -> Iterable[str]:
    """Remarks on elements that count once and stand there several times: urdfdom takes the first, too."""
    for each in (*root.findall("link"), *root.findall("joint")):
        for part in (each, *each.findall("inertial")):
            inside = "" if part is each else " in <inertial>"
            tags = Counter(child.tag for child in part if child.tag in ONCE)
            for tag, count in tags.items():
                if count > 1:
                    told = f"{count} <{tag}>{inside}: the first counts, the others do not"
                    yield f'{each.tag} "{shown(_name(each))}": {told}'


def _check_once(kind: str, names: Iterable[str]) -> None:
    seen = set[str]()
    for name in names:
        if name in seen:
            raise InputError(f'expected one <{kind}> of each name, found several of the name "{shown(name)}"')
        seen.add(name)


def _name(element: Element) -> str:
    if not (name := element.get("name", "")):
        raise InputError(f"<{element.tag}>: expected the attribute name, found none")
    return name


def _link(element: Element) -> UrdfLink:
    name = _name(element)
    label = f'link "{shown(name)}"'
    inertial = element.find("inertial")
    return UrdfLink(
        name,
        None if inertial is None else _inertial(inertial, f"{label}: <inertial>"),
        tuple(_shapes(element, "visual", label)),
        tuple(_shapes(element, "collision", label)),
    )


def _inertial(element: Element, label: str) -> Inertial:
    of_mass, inertia = element.find("mass"), element.find("inertia")
    if of_mass is None:
        raise InputError(f'{label}: expected <mass value="…"/>, found none')
    mass = _number(of_mass, "value", f"{label}: <mass>")
    if inertia is None:
        raise InputError(f"{label}: expected <inertia>, found none")
    values = dict(zip(ENTRIES, (_number(inertia, key, f"{label}: <inertia>") for key in ENTRIES), strict=True))
    J = np.array([[values["i" + "".join(sorted(a + b))] for b in "xyz"] for a in "xyz"])
    if mass < 0:
        raise InputError(f"{label}: <mass>: expected a mass not below 0, found {mass:g}")
    origin = _origin(element, label)
    C = of_rpy(*origin.rpy)
    return Inertial(mass, np.array(origin.xyz), C @ J @ C.T if any(origin.rpy) else J)


def _shapes(link: Element, kind: str, label: str) -> Iterable[MeshFile | Primitive]:
    for element in link.findall(kind):
        where = f"{label}: <{kind}>"
        for geometry in element.iterfind("geometry/*"):
            if geometry.tag == "mesh" and (filename := geometry.get("filename")):
                scale = _triple(geometry, "scale", (1.0, 1.0, 1.0), f"{where}: <mesh>")
                yield MeshFile(filename, scale, _origin(element, where))
            elif geometry.tag == "box":
                yield Primitive("box", _sizes(geometry, "size", 3), _origin(element, where))
            elif geometry.tag == "cylinder":
                sizes = *_sizes(geometry, "radius"), *_sizes(geometry, "length")
                yield Primitive("cylinder", sizes, _origin(element, where))
            elif geometry.tag == "sphere":
                yield Primitive("sphere", _sizes(geometry, "radius"), _origin(element, where))


def _sizes(shape: Element, key: str, count: int = 1) -> tuple[float, ...]:
    """Sizes, m; NaN where there are none: a shape that only viewers need may be wrong."""
    try:
        sizes = tuple(map(float, shape.get(key, "").split()))
    except ValueError:
        sizes = ()
    return sizes if len(sizes) == count and min(sizes) >= 0 else (math.nan,) * count


def _joint(element: Element) -> UrdfJoint:
    name = _name(element)
    label = f'joint "{shown(name)}"'
    kind = element.get("type", "")
    if kind not in TYPES:
        raise InputError(f'{label}: type: expected one of {quoted(TYPES)}, found "{shown(kind)}"')
    axis = element.find("axis")
    along = (1.0, 0.0, 0.0) if axis is None else _triple(axis, "xyz", (1.0, 0.0, 0.0), f"{label}: <axis>")
    if not any(along) and kind in ("revolute", "continuous", "prismatic", "planar"):
        raise InputError(f"{label}: <axis>: expected a direction, found 0 0 0")
    return UrdfJoint(
        name, kind, _end(element, "parent", label), _end(element, "child", label), _origin(element, label), along,
        _attributes(element, "limit", ("lower", "upper", "effort", "velocity"), label),
        _attributes(element, "dynamics", ("damping", "friction"), label),
        _mimic(element, label),
    )  # fmt: skip


def _end(joint: Element, kind: str, label: str) -> str:
    end = joint.find(kind)
    if end is None or not (name := end.get("link", "")):
        raise InputError(f'{label}: expected <{kind} link="…"/>, found none')
    return name


def _mimic(joint: Element, label: str) -> Mimic | None:
    element = joint.find("mimic")
    if element is None:
        return None
    if not (name := element.get("joint", "")):
        raise InputError(f"{label}: <mimic>: expected the attribute joint, found none")
    where = f"{label}: <mimic>"
    return Mimic(name, _number(element, "multiplier", where, 1.0), _number(element, "offset", where, 0.0))


def _attributes(joint: Element, tag: str, keys: Iterable[str], label: str) -> dict[str, float]:
    element = joint.find(tag)
    if element is None:
        return {}
    return {key: _number(element, key, f"{label}: <{tag}>") for key in keys if element.get(key) is not None}


def _origin(element: Element, label: str) -> Origin:
    origin = element.find("origin")
    if origin is None:
        return Origin()
    where = f"{label}: <origin>"
    return Origin(_triple(origin, "xyz", (0.0, 0.0, 0.0), where), _triple(origin, "rpy", (0.0, 0.0, 0.0), where))


def _number(element: Element, key: str, label: str, default: float | None = None) -> float:
    text = element.get(key)
    if text is None:
        if default is None:
            raise InputError(f"{label}: expected the attribute {key}, found none")
        return default
    return _finite(text, f"{label}: {key}")


def _triple(element: Element, key: str, default: Numbers3, label: str) -> Numbers3:
    text = element.get(key)
    if text is None:
        return default
    parts = text.split()
    if len(parts) != 3:
        raise InputError(f'{label}: {key}: expected three numbers, found "{shown(text)}"')
    return three(_finite(part, f"{label}: {key}") for part in parts)


def _finite(text: str, label: str) -> float:
    try:
        value = float(text)
    except ValueError:
        value = math.nan
    if not math.isfinite(value):
        raise InputError(f'{label}: expected a finite number, found "{shown(text)}"')
    if abs(value) > LARGEST:
        raise InputError(f"{label}: expected a number between -{LARGEST:g} and {LARGEST:g}, found {value:g}")
    return value


def root_of(links: Sequence[str], joints: Sequence[UrdfJoint]) -> str:
    """The one link that no joint carries.

    Raises:
        InputError: a joint names a link that does not exist, a link has two parents, there is more than one tree.
    """
    if not links:
        raise InputError("expected at least one <link>, found none")
    carried = dict[str, str]()
    for joint in joints:
        label = f'joint "{shown(joint.name)}"'
        for kind, name in (("parent", joint.parent), ("child", joint.child)):
            if name not in links:
                raise InputError(f'{label}: <{kind}>: expected a link of the file, found "{shown(name)}"'
                                 + did_you_mean(name, links))  # fmt: skip
        if joint.child in carried:
            raise InputError(
                f'{label}: expected one joint that carries link "{shown(joint.child)}", found a second one, "'
                f'{shown(carried[joint.child])}" being the first: URDF has trees only; close the loop in the scene'
            )
        carried[joint.child] = joint.name
    roots = [name for name in links if name not in carried]
    if not roots:
        raise InputError("expected one link that no joint carries, found none: the joints form a circle")
    if len(roots) > 1:
        raise InputError(
            f"expected one link that no joint carries, found {len(roots)}: {quoted(roots)}; join them by fixed joints"
        )
    _check_reached(roots[0], links, joints)
    return roots[0]


def _check_reached(root: str, links: Sequence[str], joints: Sequence[UrdfJoint]) -> None:
    """Links with a parent each, but not below the root, form circles."""
    reached, todo = {root}, [root]
    while todo:
        link = todo.pop()
        below = [joint.child for joint in joints if joint.parent == link]
        reached.update(below)
        todo += below
    if left := [name for name in links if name not in reached]:
        raise InputError(f'expected all links to be carried by "{shown(root)}", found a circle of {quoted(left)}')


def check_mimics(joints: Mapping[str, UrdfJoint]) -> None:
    """Raise `InputError` where a mimic joint follows one that does not exist, or in the end itself."""
    for joint in joints.values():
        label, chain = f'joint "{shown(joint.name)}": <mimic>', [joint.name]
        while (follows := joints[chain[-1]].mimic) is not None:
            if follows.joint not in joints:
                raise InputError(f'{label}: expected a joint of the file, found "{shown(follows.joint)}"'
                                 + did_you_mean(follows.joint, joints))  # fmt: skip
            if follows.joint in chain:
                raise InputError(
                    f"{label}: expected a joint that moves freely at the end of the chain, found a circle:"
                    f" {' → '.join([*chain, follows.joint])}"
                )
            chain.append(follows.joint)
