"""URDF robot descriptions (wiki.ros.org/urdf/XML) as records, nothing merged or left out; SI units."""

import math
import re
from collections import Counter
from collections.abc import Container, Iterable, Iterator, Mapping, Sequence
from dataclasses import field
from pathlib import Path
from typing import Literal
from xml.etree import ElementTree
from xml.parsers import expat

import numpy as np

from ...common.arrays import Array
from ...common.errors import InputError, check_known, finite, naming, quoted
from ...common.keys import LONGEST_NAME
from ...common.rotations import of_quaternion, of_rpy, point_inertia, rpy_of
from ...common.structs import struct
from ...common.tables import shown
from ...common.toml_files import read_bytes
from ...mbs.model.body import Body

Numbers3 = tuple[float, float, float]


def three(values: Iterable[float]) -> Numbers3:
    """Return three values as Python floats."""
    x, y, z = map(float, values)
    return x, y, z


TYPES = ("revolute", "continuous", "prismatic", "planar", "floating", "fixed")
"""Types of joints that URDF has."""
WITH_AXIS = TYPES[:4]


@struct
class Origin:
    """Pose of a frame in another: `xyz` (m), and `rpy` (rad) about the fixed axes x, y, z in this order."""

    xyz: Numbers3 = (0.0, 0.0, 0.0)
    rpy: Numbers3 = (0.0, 0.0, 0.0)

    @property
    def place(self) -> "Place":
        """Return the pose with its rotation matrix."""
        return Place(np.array(self.xyz), of_rpy(*self.rpy))


@struct
class Place:
    """Pose of a frame in another: origin d (3,), m, and axes C (3, 3), columns, both in axes of the other."""

    d: Array
    C: Array

    def __matmul__(self, inner: "Place") -> "Place":
        """Return the frame `inner`, which is in this one, in the other."""
        return Place(self.d + self.C @ inner.d, self.C @ inner.C)


HERE = Place(np.zeros(3), np.eye(3))


@struct
class Inertial:
    """Mass (kg), center of mass (3,) in m and inertia (3, 3) about it in kg·m², in axes of the link."""

    mass: float
    center: Array
    inertia: Array

    def seen_from(self, place: Place) -> "Inertial":
        """Return mass properties in the frame in which the link's frame has the pose `place`."""
        return Inertial(self.mass, place.d + place.C @ self.center, place.C @ self.inertia @ place.C.T)

    def __add__(self, other: "Inertial") -> "Inertial":
        """Both together (parallel axes)."""
        mass = self.mass + other.mass
        center = (self.mass * self.center + other.mass * other.center) / mass if mass else self.center
        inertia = self.inertia + other.inertia
        for part in (self, other):
            inertia = inertia + point_inertia(part.mass, part.center - center)
        return Inertial(mass, center, inertia)


MASSLESS = Inertial(0.0, np.zeros(3), np.zeros((3, 3)))


def inertial_of(body: Body, anchor: Array) -> Inertial:
    """Return mass properties of an undeformed body with its attached masses; `anchor` (3,), m: the link's origin."""
    center = body.first_moment / body.mass
    J: Array = body.inertia - point_inertia(body.mass, center)
    return Inertial(body.mass, center - anchor, (J + J.T) / 2)


@struct
class MeshFile:
    """A mesh of a link: its file as the URDF names it, factors along its axes, and its pose in the link."""

    filename: str
    scale: Numbers3
    origin: Origin


Shape = Literal["box", "cylinder", "capsule", "sphere"]


@struct
class Primitive:
    """A shape about its center: a box of `size` x, y, z; a cylinder along z (radius, length); a sphere (radius,). m.

    A capsule (radius, length) is a cylinder with half a sphere on either end.
    """

    shape: Shape
    size: tuple[float, ...]
    origin: Origin


@struct
class UrdfLink:
    """A link: mass and inertia (None if the URDF has none), and shapes for pictures and for collisions."""

    name: str
    inertial: Inertial | None
    visual: tuple[MeshFile | Primitive, ...] = ()
    collision: tuple[MeshFile | Primitive, ...] = ()


@struct
class Mimic:
    """A coordinate is `multiplier` times that of another `joint`, plus `offset` (rad or m)."""

    joint: str
    multiplier: float
    offset: float


@struct
class UrdfJoint:
    """Joint of a URDF; `origin`: pose of the child link's frame in the parent's at coordinate zero.

    `axis` is in axes of the child. `limits` has the given ones of lower, upper, effort, velocity; `dynamics` those of
    damping, friction; SI units.
    """

    name: str
    type: str
    parent: str
    child: str
    origin: Origin = Origin()
    axis: Numbers3 = (1.0, 0.0, 0.0)
    limits: Mapping[str, float] = field(default_factory=dict)
    dynamics: Mapping[str, float] = field(default_factory=dict)
    mimic: Mimic | None = None

    @property
    def label(self) -> str:
        """Text for messages: `joint "NAME"`."""
        return f'joint "{shown(self.name)}"'

    @property
    def way(self) -> float:
        """Distance of the joint from the origin of its parent link, m."""
        return float(np.linalg.norm(self.origin.xyz))


@struct
class Robot:
    """Links and joints by name in the order of the file, the name of the `root` link, remarks on the file."""

    name: str
    links: Mapping[str, UrdfLink]
    joints: Mapping[str, UrdfJoint]
    root: str
    remarks: tuple[str, ...] = ()

    def joints_of(self, link: str) -> list[UrdfJoint]:
        """Return joints whose parent is this link."""
        return [joint for joint in self.joints.values() if joint.parent == link]


FORBIDDEN = str.maketrans({"/": "_", ".": "_"})


class Names:
    """Valid, unique names for a scene: `names[original]` is always the same; none is in `taken`."""

    def __init__(self, taken: Iterable[str] = ()) -> None:
        self._taken = set(taken)
        self._of = dict[str, str]()

    def __getitem__(self, original: str) -> str:
        if original not in self._of:
            name = "".join(c if c.isprintable() else "_" for c in original.translate(FORBIDDEN)).strip() or "_"
            name = name[: LONGEST_NAME - 4] if len(name) > LONGEST_NAME else name
            free, number = name, 1
            while free in self._taken:
                free, number = f"{name}_{number + 1}", number + 1
            self._of[original] = free
            self._taken.add(free)
        return self._of[original]

    @property
    def changed(self) -> dict[str, str]:
        """New names of the originals that were invalid or not unique."""
        return {original: name for original, name in self._of.items() if original != name}


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
"""Attributes that are read, by element; the import leaves out other elements."""
SHAPES = ("visual", "collision", "material")  # for the eye, or read as far as masses and pictures need them


def read_urdf(path: Path) -> Robot:
    """Read the robot in the URDF file at `path`.

    Raises:
        InputError: the file is no URDF, lacks elements or numbers or has wrong ones, or links form no single tree.
    """
    with naming(path):
        root = _root_element(read_bytes(path, "URDF file"))
        links = [_link(each) for each in root.findall("link")]
        joints = [_joint(each) for each in root.findall("joint")]
        for kind in ("link", "joint"):
            counts = Counter(map(_name, root.findall(kind)))
            if again := next((name for name, count in counts.items() if count > 1), None):
                raise InputError(f"expected one <{kind}> of each name", f'several of the name "{shown(again)}"')
        by_name = {joint.name: joint for joint in joints}
        _check_mimics(by_name)
        base = _root_of([link.name for link in links], joints)
        odd = (*_odd(root), *_not_read(root))
        return Robot(root.get("name", "").strip() or base, {link.name: link for link in links}, by_name, base, odd)


def _root_element(content: bytes) -> Element:
    declared = _ENCODING.match(content)  # not in UTF-16, which expat knows
    builder, parser = ElementTree.TreeBuilder(), expat.ParserCreate("utf-8" if declared else None)
    # Published files have undeclared prefixes (drake:, gazebo:).
    parser.StartElementHandler, parser.EndElementHandler = builder.start, builder.end
    parser.CharacterDataHandler = builder.data
    try:
        if declared:
            content = content.decode(declared[1].decode()).encode()  # expat knows none of several bytes a character
        parser.Parse(content, True)
        root = builder.close()
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


def _odd(root: Element) -> Iterable[str]:
    """Remarks on angles of more than a turn, and on repeated elements, of which the first counts, as in urdfdom."""
    for each in (*root.findall("link"), *root.findall("joint")):
        turned = each.find("inertial") if each.tag == "link" else each
        rpy = (0.0, 0.0, 0.0) if turned is None else _origin(turned).rpy
        if max(map(abs, rpy)) > 2 * math.pi:
            angles = " ".join(f"{angle:g}" for angle in rpy)
            yield f"{_label(each)}: rpy {angles} is more than a turn: URDF has rad, not degrees"
        for part in (each, *each.findall("inertial")):
            inside = "" if part is each else " in <inertial>"
            for tag, count in Counter(child.tag for child in part if child.tag in ONCE).items():
                if count > 1:
                    yield f"{_label(each)}: {count} <{tag}>{inside}: the first counts, the others do not"


def _not_read(root: Element) -> Iterator[str]:
    """Remarks on elements and attributes that scenes lack, one for alike ones of several links."""
    known = {child.get("name", "") for child in root if child.tag in ("link", "joint")}
    beside = [child for child in root if child.tag not in (*READ, *SHAPES)]
    for tag, count in Counter(child.tag for child in beside).items():
        inside = [each for child in beside if child.tag == tag for each in child.iter()]
        named = (each.get(key, "") for each in inside for key in ("reference", "name"))
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


def _listed(names: Iterable[str]) -> str:
    first, more = (names := list(map(shown, names)))[:6], len(names) - 6
    return quoted(first) + (f" and {more} more" if more > 0 else "")


def _left_of(element: Element) -> Iterator[tuple[tuple[str, ...], str]]:
    """Kind and text of parts of an element that are not read."""
    # The other product of inertia of two counts only where it has another value.
    twin = {key: element.get(f"i{key[2]}{key[1]}") for key in ("iyx", "izx", "izy") if element.tag == "inertia"}
    left = {
        key: value
        for key, value in element.items()
        if not (key in READ[element.tag] or key.startswith("xmlns") or value == twin.get(key))
    }
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
"""Attributes of shapes, with their count of numbers."""


def _text(element: Element, key: str, default: str = "") -> str:
    if not (text := element.get(key, default)):
        raise InputError(f"<{element.tag}>: expected the attribute {key}", "none")
    return text


def _name(element: Element) -> str:
    return _text(element, "name")


def _label(element: Element) -> str:
    return f'{element.tag} "{shown(_name(element))}"'


def _link(element: Element) -> UrdfLink:
    with naming(_label(element)):
        part = element.find("inertial")
        inertial = None if part is None else _inertial(part)
        return UrdfLink(_name(element), inertial, *(tuple(_shapes(element, kind)) for kind in ("visual", "collision")))


@naming("<inertial>")
def _inertial(element: Element) -> Inertial:
    of_mass, inertia = element.find("mass"), element.find("inertia")
    if of_mass is None:
        raise InputError('expected <mass value="…"/>', "none")
    mass = _number(of_mass, "value")
    if inertia is None:
        raise InputError("expected <inertia>", "none")
    values = {key: _number(inertia, key) for key in ENTRIES}
    J = np.array([[values["i" + "".join(sorted(a + b))] for b in "xyz"] for a in "xyz"])
    if mass < 0:
        raise InputError("<mass>: expected a mass not below 0", f"{mass:g}")
    origin = _origin(element)
    C = of_rpy(*origin.rpy)
    return Inertial(mass, np.array(origin.xyz), C @ J @ C.T if any(origin.rpy) else J)


def _shapes(link: Element, kind: str) -> Iterable[MeshFile | Primitive]:
    for element in link.findall(kind):
        with naming(f"<{kind}>"):
            for geometry in element.iterfind("geometry/*"):
                if geometry.tag == "mesh" and (filename := geometry.get("filename")):
                    scale = _numbers(geometry, "scale", "1 1 1")
                    yield MeshFile(filename, three(scale), _origin(element))
                for shape, counts in SIZES.items():
                    if geometry.tag == shape:
                        sizes = (size for key, count in counts.items() for size in _sizes(geometry, key, count))
                        yield Primitive(shape, tuple(sizes), _origin(element))


def _sizes(shape: Element, key: str, count: int) -> tuple[float, ...]:
    """Sizes, m; NaN where there are none: a shape that only viewers need may be wrong."""
    try:
        sizes = tuple(map(float, shape.get(key, "").split()))
    except ValueError:
        sizes = ()
    return sizes if len(sizes) == count and min(sizes) >= 0 else (math.nan,) * count


def _joint(element: Element) -> UrdfJoint:
    with naming(_label(element)):
        kind, axis = element.get("type", ""), element.find("axis")
        check_known(kind, TYPES, f"type: expected one of {quoted(TYPES)}")
        along = (1.0, 0.0, 0.0) if axis is None else three(_numbers(axis, "xyz", "1 0 0"))
        if not any(along) and kind in WITH_AXIS:
            raise InputError("<axis>: expected a direction", "0 0 0")
        return UrdfJoint(
            name=_name(element),
            type=kind,
            parent=_end(element, "parent"),
            child=_end(element, "child"),
            origin=_origin(element),
            axis=along,
            limits=_attributes(element, "limit"),
            dynamics=_attributes(element, "dynamics"),
            mimic=_mimic(element.find("mimic")),
        )


def _end(joint: Element, kind: str) -> str:
    end = joint.find(kind)
    if end is None or not (name := end.get("link", "")):
        raise InputError(f'expected <{kind} link="…"/>', "none")
    return name


def _mimic(element: Element | None) -> Mimic | None:
    if element is None:
        return None
    return Mimic(_text(element, "joint"), _number(element, "multiplier", "1"), _number(element, "offset", "0"))


def _attributes(joint: Element, tag: str) -> dict[str, float]:
    element = joint.find(tag)
    if element is None:
        return {}
    return {key: _number(element, key) for key in element.attrib if key in READ[tag]}


def _origin(element: Element) -> Origin:
    origin = element.find("origin")
    if origin is None:
        return Origin()
    xyz = three(_numbers(origin, "xyz"))
    if origin.get("quat_xyzw") is None:
        return Origin(xyz, three(_numbers(origin, "rpy")))
    if origin.get("rpy") is not None:  # URDF 1.1 has it or a quaternion, scalar last
        raise InputError("<origin>: expected rpy or quat_xyzw", "both")
    *vector, scalar = _numbers(origin, "quat_xyzw", "0 0 0 1")
    e = np.array([scalar, *vector])
    size = float(np.linalg.norm(e))
    if abs(size - 1.0) > 0.1:  # less is few digits
        raise InputError("<origin>: quat_xyzw: expected a quaternion of length 1", f"length {size:g}")
    return Origin(xyz, three(rpy_of(of_quaternion(e / size))))


def _number(element: Element, key: str, default: str = "") -> float:
    return finite(_text(element, key, default), f"<{element.tag}>: {key}")


def _numbers(element: Element, key: str, default: str = "0 0 0") -> list[float]:
    """As many as `default` has, which stands for a missing attribute."""
    text, count = element.get(key, default), len(default.split())
    if len(parts := text.split()) != count:
        raise InputError(f"<{element.tag}>: {key}: expected {count} numbers", f'"{shown(text)}"')
    return [finite(part, f"<{element.tag}>: {key}") for part in parts]


def _root_of(links: Sequence[str], joints: Sequence[UrdfJoint]) -> str:
    """The one link that no joint carries, where all links form one tree."""
    if not links:
        raise InputError("expected at least one <link>", "none")
    carried = dict[str, str]()
    for joint in joints:
        for kind, name in (("parent", joint.parent), ("child", joint.child)):
            check_known(name, links, f"{joint.label}: <{kind}>: expected a link of the file")
        if joint.child in carried:
            raise InputError(
                f'{joint.label}: expected one joint that carries link "{shown(joint.child)}"',
                f'a second one, "{shown(carried[joint.child])}" being the first: URDF has trees only; close the loop'
                " in the scene",
            )
        carried[joint.child] = joint.name
    roots = [name for name in links if name not in carried]
    if len(roots) != 1:
        several = f"{len(roots)}: {quoted(roots)}; join them by fixed joints"
        raise InputError(
            "expected one link that no joint carries", several if roots else "none: the joints form a circle"
        )
    reached = roots.copy()
    for link in reached:  # which grows
        reached += [joint.child for joint in joints if joint.parent == link]
    if left := [name for name in links if name not in reached]:  # with a parent each
        raise InputError(f'expected all links to be carried by "{shown(roots[0])}"', f"a circle of {quoted(left)}")
    return roots[0]


def _check_mimics(joints: Mapping[str, UrdfJoint]) -> None:
    for joint in joints.values():
        label, chain = f"{joint.label}: <mimic>", [joint.name]
        while (follows := joints[chain[-1]].mimic) is not None:
            check_known(follows.joint, joints, f"{label}: expected a joint of the file")
            if follows.joint in chain:
                raise InputError(
                    f"{label}: expected a joint that moves freely at the end of the chain",
                    f"a circle: {' → '.join([*chain, follows.joint])}",
                )
            chain.append(follows.joint)
