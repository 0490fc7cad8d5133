"""Reading URDF files: elements and numbers, with messages that name file, element, what was expected and found."""

from __future__ import annotations

import math
import re
from collections import Counter
from collections.abc import Container, Iterable, Iterator, Mapping, Sequence
from contextlib import contextmanager
from pathlib import Path
from xml.etree import ElementTree
from xml.parsers import expat

import numpy as np

from ...common.errors import InputError, check_known, quoted
from ...common.rotations import of_quaternion, of_rpy, rpy_of
from ...common.tables import LARGEST, shown
from ...common.toml_files import read_bytes
from .robot import (
    TYPES,
    Inertial,
    MeshFile,
    Mimic,
    Numbers3,
    Origin,
    Primitive,
    Robot,
    Shape,
    UrdfJoint,
    UrdfLink,
    three,
)

Element = ElementTree.Element

_ENCODING = re.compile(rb"""(?:\xef\xbb\xbf)?<\?xml[^>]*?\sencoding=["']([\w.-]+)["']""")
ONCE = {"inertial", "origin", "mass", "inertia", "parent", "child", "axis", "limit", "dynamics", "mimic"}
ENTRIES = ("ixx", "iyy", "izz", "ixy", "ixz", "iyz")
READ: Mapping[str, Container[str]] = {
    "robot": {"name", "version"},
    "link": {"name"},
    "joint": {"name", "type"},
    "inertial": (),
    "mass": {"value"},
    "inertia": ENTRIES,
    "origin": {"xyz", "rpy", "quat_xyzw"},
    "parent": {"link"},
    "child": {"link"},
    "axis": {"xyz"},
    "limit": {"lower", "upper", "effort", "velocity"},
    "dynamics": {"damping", "friction"},
    "mimic": {"joint", "multiplier", "offset"},
}
"""Attributes that are read, by element; of elements that are not here the import leaves out all."""
UNIT = 0.1  # how far from 1 the length of a quaternion may be by its digits
SHAPES = ("visual", "collision", "material")  # for the eye, or read as far as masses and pictures need them


def read_urdf(path: Path) -> Robot:
    """The robot in the URDF file at `path`.

    Raises:
        InputError: it cannot be read, is no URDF, an element or number is missing or wrong, links do not form one tree.
    """
    with lines_of(path):
        return _robot_of(_root_element(read_bytes(path, "URDF file")))


@contextmanager
def lines_of(path: Path) -> Iterator[None]:
    """Have each line of an `InputError` begin with the file, unless it does already."""
    try:
        yield
    except InputError as error:
        if str(error).startswith(f"{path}:"):
            raise
        raise InputError("\n".join(f"{path}: {line}" for line in str(error).splitlines())) from None


def _root_element(content: bytes) -> Element:
    try:
        root = _parsed(content)
    except (expat.ExpatError, LookupError, ValueError) as error:
        is_xml = content.lstrip(b"\xef\xbb\xbf \t\r\n").startswith((b"<", b"\xff\xfe", b"\xfe\xff"))
        what = f"XML that is not well-formed: {error}" if is_xml else "a file that is no XML"
        raise InputError("expected a URDF file", what) from None
    prefixes = {key.partition(":")[2] for key, value in root.items() if "ros.org/wiki/xacro" in value} | {"xacro"}
    if xacro := next((each.tag for each in root.iter() if each.tag.partition(":")[0] in prefixes), None):
        raise InputError(
            "expected a URDF file",
            f"<{shown(xacro)}>: run `xacro FILE.xacro > ROBOT.urdf` first, in an environment with ROS or with PyPI's"
            " xacro",
        )
    if root.tag != "robot":
        of = " of another program: convert it to URDF first" if root.tag in ("mujoco", "sdf") else ""
        raise InputError("expected a URDF file, whose root is <robot>", f"<{shown(root.tag)}>{of}")
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


def _robot_of(root: Element) -> Robot:
    links = [_link(each) for each in root.findall("link")]
    joints = [_joint(each) for each in root.findall("joint")]
    for kind, records in (("link", links), ("joint", joints)):
        if again := next((name for name, count in Counter(one.name for one in records).items() if count > 1), None):
            raise InputError(f"expected one <{kind}> of each name", f'several of the name "{shown(again)}"')
    by_name = {joint.name: joint for joint in joints}
    check_mimics(by_name)
    base = root_of([link.name for link in links], joints)
    name = root.get("name", "").strip() or base
    odd = (*_turned(root), *_repeated(root), *_not_read(root))
    return Robot(name, {link.name: link for link in links}, by_name, base, odd)


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


def _not_read(root: Element) -> Iterator[str]:
    """Remarks on elements and attributes that have no place in a scene; on alike ones of several links one remark."""
    known = {child.get("name", "") for child in root if child.tag in ("link", "joint")}
    beside = [child for child in root if child.tag not in (*READ, *SHAPES)]
    for tag, count in Counter(child.tag for child in beside).items():
        named = (each.get(key, "") for child in beside if child.tag == tag for each in child.iter() for key in NAMING)
        about = dict.fromkeys(name for name in named if name in known)
        extra = ": a joint describes its motor by rotor_inertia and gear_ratio" if tag == "transmission" else ""
        yield f"{count} <{shown(tag)}> left out{f', of {_listed(about)}' if about else ''}{extra}"
    alike = dict[tuple[str, ...], dict[str, str]]()
    for each in (root, *root.findall("link"), *root.findall("joint")):
        for kind, text in _left_of(each):
            alike.setdefault((each.tag, *kind), {})[_name(each) if each is not root else ""] = text
    for (tag, *_), of in alike.items():
        (first, text), *more = of.items()
        likewise = f"; likewise of {_listed(name for name, _ in more)}" if more else ""
        yield f"{text} of {tag} {quoted([shown(first)]) if first else ''} left out{likewise}".replace("  ", " ")


NAMING = ("reference", "name")


def _listed(names: Iterable[str]) -> str:
    first, more = (names := list(map(shown, names)))[:6], len(names) - 6
    return quoted(first) + (f" and {more} more" if more > 0 else "")


def _left_of(element: Element) -> Iterator[tuple[tuple[str, ...], str]]:
    """What is not read of an element and of those inside it: of which kind, and as it stands there.

    The other product of inertia of two only where it is another one.
    """
    twin = {key: element.get(f"i{key[2]}{key[1]}") for key in ("iyx", "izx", "izy") if element.tag == "inertia"}
    left = {key: value for key, value in element.items() if key not in READ[element.tag]}
    left = {key: value for key, value in left.items() if not key.startswith("xmlns") and value != twin.get(key)}
    if left:
        words = " ".join(f'{shown(key)}="{shown(value)}"' for key, value in left.items())
        yield (element.tag, *left), f"<{element.tag} {words}>"
    for child in element if element.tag != "robot" else ():
        if child.tag in READ:
            yield from _left_of(child)
        elif child.tag not in SHAPES:
            yield (child.tag,), f"<{shown(child.tag)}>"
        for shape in child.iterfind("geometry/*") if child.tag in SHAPES else ():
            if shape.tag not in ("mesh", *SIZES):
                yield (child.tag, shape.tag), f"<{shown(shape.tag)}> in <{child.tag}>"


SIZES: Mapping[Shape, Mapping[str, int]] = {
    "box": {"size": 3},
    "cylinder": {"radius": 1, "length": 1},
    "capsule": {"radius": 1, "length": 1},
    "sphere": {"radius": 1},
}
"""Attributes of shapes with so many numbers each."""


def _name(element: Element) -> str:
    if not (name := element.get("name", "")):
        raise InputError(f"<{element.tag}>: expected the attribute name", "none")
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
        raise InputError(f'{label}: expected <mass value="…"/>', "none")
    mass = _number(of_mass, "value", f"{label}: <mass>")
    if inertia is None:
        raise InputError(f"{label}: expected <inertia>", "none")
    values = dict(zip(ENTRIES, (_number(inertia, key, f"{label}: <inertia>") for key in ENTRIES), strict=True))
    J = np.array([[values["i" + "".join(sorted(a + b))] for b in "xyz"] for a in "xyz"])
    if mass < 0:
        raise InputError(f"{label}: <mass>: expected a mass not below 0", f"{mass:g}")
    origin = _origin(element, label)
    C = of_rpy(*origin.rpy)
    return Inertial(mass, np.array(origin.xyz), C @ J @ C.T if any(origin.rpy) else J)


def _shapes(link: Element, kind: str, label: str) -> Iterable[MeshFile | Primitive]:
    for element in link.findall(kind):
        where = f"{label}: <{kind}>"
        for geometry in element.iterfind("geometry/*"):
            if geometry.tag == "mesh" and (filename := geometry.get("filename")):
                scale = three(_numbers(geometry, "scale", (1.0, 1.0, 1.0), f"{where}: <mesh>"))
                yield MeshFile(filename, scale, _origin(element, where))
            for shape, counts in SIZES.items():
                if geometry.tag == shape:
                    sizes = (size for key, count in counts.items() for size in _sizes(geometry, key, count))
                    yield Primitive(shape, tuple(sizes), _origin(element, where))


def _sizes(shape: Element, key: str, count: int) -> tuple[float, ...]:
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
    check_known(kind, TYPES, f"{label}: type: expected one of {quoted(TYPES)}")
    axis = element.find("axis")
    along = (1.0, 0.0, 0.0) if axis is None else three(_numbers(axis, "xyz", (1.0, 0.0, 0.0), f"{label}: <axis>"))
    if not any(along) and kind in ("revolute", "continuous", "prismatic", "planar"):
        raise InputError(f"{label}: <axis>: expected a direction", "0 0 0")
    return UrdfJoint(
        name=name,
        type=kind,
        parent=_end(element, "parent", label),
        child=_end(element, "child", label),
        origin=_origin(element, label),
        axis=along,
        limits=_attributes(element, "limit", label),
        dynamics=_attributes(element, "dynamics", label),
        mimic=_mimic(element, label),
    )


def _end(joint: Element, kind: str, label: str) -> str:
    end = joint.find(kind)
    if end is None or not (name := end.get("link", "")):
        raise InputError(f'{label}: expected <{kind} link="…"/>', "none")
    return name


def _mimic(joint: Element, label: str) -> Mimic | None:
    element = joint.find("mimic")
    if element is None:
        return None
    if not (name := element.get("joint", "")):
        raise InputError(f"{label}: <mimic>: expected the attribute joint", "none")
    where = f"{label}: <mimic>"
    return Mimic(name, _number(element, "multiplier", where, 1.0), _number(element, "offset", where, 0.0))


def _attributes(joint: Element, tag: str, label: str) -> dict[str, float]:
    element = joint.find(tag)
    if element is None:
        return {}
    return {key: _number(element, key, f"{label}: <{tag}>") for key in element.attrib if key in READ[tag]}


def _origin(element: Element, label: str) -> Origin:
    origin = element.find("origin")
    if origin is None:
        return Origin()
    where = f"{label}: <origin>"
    return Origin(three(_numbers(origin, "xyz", (0.0, 0.0, 0.0), where)), _rpy(origin, where))


def _rpy(origin: Element, where: str) -> Numbers3:
    """Roll, pitch and yaw of an <origin>, which URDF 1.1 may have as a quaternion, scalar last."""
    if origin.get("quat_xyzw") is None:
        return three(_numbers(origin, "rpy", (0.0, 0.0, 0.0), where))
    if origin.get("rpy") is not None:
        raise InputError(f"{where}: expected rpy or quat_xyzw", "both")
    *vector, scalar = _numbers(origin, "quat_xyzw", (0.0, 0.0, 0.0, 1.0), where)
    e = np.array([scalar, *vector])
    size = float(np.linalg.norm(e))
    if abs(size - 1.0) > UNIT:
        raise InputError(f"{where}: quat_xyzw: expected a quaternion of length 1", f"length {size:g}")
    return three(rpy_of(of_quaternion(e / size)))


def _number(element: Element, key: str, label: str, default: float | None = None) -> float:
    text = element.get(key)
    if text is None:
        if default is None:
            raise InputError(f"{label}: expected the attribute {key}", "none")
        return default
    return _finite(text, f"{label}: {key}")


def _numbers(element: Element, key: str, default: tuple[float, ...], label: str) -> tuple[float, ...]:
    """As many as `default` has, which stands for a missing attribute."""
    text = element.get(key)
    if text is None:
        return default
    parts = text.split()
    if len(parts) != len(default):
        raise InputError(f"{label}: {key}: expected {len(default)} numbers", f'"{shown(text)}"')
    return tuple(_finite(part, f"{label}: {key}") for part in parts)


def _finite(text: str, label: str) -> float:
    try:
        value = float(text)
    except ValueError:
        value = math.nan
    if not math.isfinite(value):
        raise InputError(f"{label}: expected a finite number", f'"{shown(text)}"')
    if abs(value) > LARGEST:
        raise InputError(f"{label}: expected a number between -{LARGEST:g} and {LARGEST:g}", f"{value:g}")
    return value


def root_of(links: Sequence[str], joints: Sequence[UrdfJoint]) -> str:
    """The one link that no joint carries.

    Raises:
        InputError: a joint names a link that does not exist, a link has two parents, there is more than one tree.
    """
    if not links:
        raise InputError("expected at least one <link>", "none")
    carried = dict[str, str]()
    for joint in joints:
        label = f'joint "{shown(joint.name)}"'
        for kind, name in (("parent", joint.parent), ("child", joint.child)):
            check_known(name, links, f"{label}: <{kind}>: expected a link of the file")
        if joint.child in carried:
            raise InputError(
                f'{label}: expected one joint that carries link "{shown(joint.child)}"',
                f'a second one, "{shown(carried[joint.child])}" being the first: URDF has trees only; close the loop'
                " in the scene",
            )
        carried[joint.child] = joint.name
    roots = [name for name in links if name not in carried]
    if not roots:
        raise InputError("expected one link that no joint carries", "none: the joints form a circle")
    if len(roots) > 1:
        raise InputError(
            "expected one link that no joint carries", f"{len(roots)}: {quoted(roots)}; join them by fixed joints"
        )
    reached = roots.copy()
    for link in reached:  # which grows
        reached += [joint.child for joint in joints if joint.parent == link]
    if left := [name for name in links if name not in reached]:  # with a parent each
        raise InputError(f'expected all links to be carried by "{shown(roots[0])}"', f"a circle of {quoted(left)}")
    return roots[0]


def check_mimics(joints: Mapping[str, UrdfJoint]) -> None:
    """Raise `InputError` where a mimic joint follows one that does not exist, or in the end itself."""
    for joint in joints.values():
        label, chain = f'joint "{shown(joint.name)}": <mimic>', [joint.name]
        while (follows := joints[chain[-1]].mimic) is not None:
            check_known(follows.joint, joints, f"{label}: expected a joint of the file")
            if follows.joint in chain:
                raise InputError(
                    f"{label}: expected a joint that moves freely at the end of the chain",
                    f"a circle: {' → '.join([*chain, follows.joint])}",
                )
            chain.append(follows.joint)
