"""Bodies and payloads of a scene, key by key. SI units."""

from pathlib import Path
from typing import Annotated, Literal, Self

import numpy as np
from pydantic import AfterValidator, Field, ValidationInfo, model_validator

from ...common.arrays import Array
from ...common.deferred import ReadBy, Table
from ...common.keys import MOST_MODES, PathName
from ...common.validation import InputFile, Record, existing_file
from ...fe_models.link_source import LinkSource, LinkTable
from ..fields.field_types import (
    Name,
    NotNegative,
    PointReference,
    Positive,
    Quantity,
    Referring,
    Vector3,
    one_of,
    split_point,
)
from ..fields.spelling import IN_PLANE, IN_SPACE, Spelled, Vector, inertia_about_z

Inertia = Vector3 | tuple[Vector3, Vector3, Vector3]
ROUND_OFF = 1e-9  # of the largest entry of an inertia tensor


def tensor(inertia: Inertia) -> Array:
    """The inertia tensor (3, 3), kg·m², from [xx, yy, zz] or all nine entries."""
    array = np.array(inertia, dtype=float)
    return np.diag(array) if array.ndim == 1 else array


def check_inertia(inertia: Inertia) -> Inertia:
    """`inertia`, kg·m². Raises `ValueError` if unsymmetric, or a principal moment exceeds the sum of the others.

    Moments may be zero: those of a point mass, and of a rod about its axis.
    """
    J = tensor(inertia)
    slack = ROUND_OFF * np.abs(J).max()
    if np.abs(J - J.T).max() > slack:
        raise ValueError(f"expected a symmetric inertia, found {J.tolist()}")
    moments = np.linalg.eigvalsh(J)
    if moments[0] < -slack:
        raise ValueError(f"expected principal moments of inertia not below 0, found {moments[0]:g}")
    if moments[2] > moments[0] + moments[1] + slack:
        raise ValueError(
            f"expected no principal moment of inertia larger than the sum of the others, found"
            f" {', '.join(f'{moment:g}' for moment in moments)}"
        )
    return inertia


PRIMITIVES = ("box", "cylinder", "sphere")


class Visual(Record):
    """A shape that pictures show of a rigid body, without effect on the motion: mesh, box, cylinder or sphere."""

    mesh: PathName | None = None
    """File of a surface (.stl, .obj, .dae …), from the folder of the scene on; in m, or in the unit that DAE and 3MF
    files state."""
    scale: Vector3 = (1.0, 1.0, 1.0)
    """Factors of the coordinates of `mesh` along its axes."""
    box: tuple[Positive, Positive, Positive] | None = None
    """Lengths along x, y and z, m."""
    cylinder: tuple[Positive, Positive] | None = None
    """Radius and length along z, m."""
    sphere: Positive | None = None
    """Radius, m."""
    at: Vector3 = (0.0, 0.0, 0.0)
    """Origin of the shape, m, axes of the body: the center of a box, cylinder or sphere."""
    rpy: Vector3 = (0.0, 0.0, 0.0)
    """Roll, pitch and yaw of the shape about the fixed axes x, y, z of the body, rad."""

    @model_validator(mode="after")
    def _is_one_shape(self) -> Self:
        one_of(self, ("mesh", *PRIMITIVES))
        return self


class RigidBody(Record):
    """A rigid body, with all vectors in its axes."""

    mass: Positive
    """Mass, kg."""
    inertia: Annotated[Inertia, Spelled(NotNegative, inertia_about_z), AfterValidator(check_inertia)]
    """Inertia about the center of mass, body axes, kg·m²: [xx, yy, zz], or a 3 × 3 matrix; planar scenes about z."""
    center: Vector
    """Center of mass, m, axes of the body."""
    points: dict[Name, Vector] = Field(default_factory=dict)
    """Points for joints, loads and trajectories by name: m, axes of the body."""
    visual: Annotated[tuple[Table[Visual], ...], IN_SPACE] = ()
    """Shapes that pictures show."""


def _link(value: object, info: ValidationInfo) -> LinkSource:
    if isinstance(value, str):
        return existing_file(Path(value), info)
    if not isinstance(value, dict):
        raise ValueError(f"expected the name of a link file in quotes or a table of its keys, found {value!r}")
    name, path = info.data.get("name", "?"), info.context["path"] if info.context else Path("scene")
    return LinkTable({"name": name, **value}, path.with_name(f'{path.name}: body "{name}": link'))


LinkInput = Annotated[LinkSource, ReadBy(_link, "ffrobot.fe_models.link_records.link:LinkInScene")]


ModeCount = Literal["auto"] | Annotated[int, Field(ge=0, le=MOST_MODES)]


class BodyKeys(Record):
    """A link file or a table of its keys (stage 1 runs if needed), a modal body file, or a rigid body.

    The default `name` in a table of a link's keys is that of the body. A link moves in the families of modes that its
    file has, and is rigid in the others.

    Modes beyond `modes` are represented by their static flexibility. If there are at least as many patches as modes in
    the file, voltages supply the forces of all of them, else of the kept ones. Results of a link in `pieces` are
    those of the whole link; geometric stiffening is then on by default.
    """

    name: Name
    """Name of the body, unique in the scene."""
    link: LinkInput | None = None
    """Link file, or a table with its keys; stage 1 runs if needed."""
    modal: InputFile | None = None
    """Modal body file, written by stage 1."""

    modes: ModeCount | None = None
    """Number of the lowest modes; "auto": as many as the tolerances need; default: all. Planar scenes count in-plane
    modes, 3D scenes those of all families."""
    pieces: Literal["auto"] | Annotated[int, Field(ge=1, le=100)] | None = None
    """Number of welded segments of a beam link for large deflections; "auto" chooses it."""
    rigid: Table[RigidBody] | None = None
    """Data of a rigid body."""

    @model_validator(mode="after")
    def _is_one_of_three(self) -> Self:
        one_of(self, ("link", "modal", "rigid"))
        if self.modes is not None and self.link is None and self.modal is None:
            raise ValueError(f'expected the key "modes" only in flexible bodies, found it in a rigid one: {self.modes}')
        if self.pieces is not None and (self.link is None or self.modes is not None):
            beside = "modes" if self.modes is not None else "modal" if self.modal is not None else "rigid"
            raise ValueError(f'expected "pieces" with "link" alone, found "{beside}"')
        return self


class Tool(Referring):
    """A frame that moves and turns with a point of a body, without mass: one more point of the body, "BODY.NAME"."""

    name: Name
    """Name of the point, unique on its body."""
    point: PointReference
    """Point that carries it, "BODY.POINT"."""
    at: Vector = (0.0, 0.0, 0.0)
    """Position, m from that point, axes of the body."""
    rpy: Annotated[tuple[Quantity, Quantity, Quantity], IN_SPACE] = (0.0, 0.0, 0.0)
    """Orientation in the axes of the body: roll, pitch, yaw about its x, y, z in this order, rad (or "90*deg")."""
    angle: Annotated[Quantity, IN_PLANE] = 0.0
    """Angle of its x axis against that of the body, rad (or such as "90*deg")."""

    refers_to = (("point", "body"),)

    @property
    def reference(self) -> str:
        """Reference to the tool as a point, "BODY.NAME"."""
        return f"{split_point(self.point)[0]}.{self.name}"


class Payload(Referring):
    """A mass (kg) on a section of a body, with its inertia about its own center of mass (kg·m²)."""

    point: PointReference
    """Point of the mass, "BODY.POINT"."""
    mass: NotNegative
    """Mass, kg."""
    center: Vector = (0.0, 0.0, 0.0)
    """Center of mass, m from the point, axes of the body or tool."""
    inertia: Annotated[Inertia, Spelled(NotNegative, inertia_about_z), AfterValidator(check_inertia)] = (0.0, 0.0, 0.0)
    """Inertia about that center, axes of the body or tool, kg·m²: [xx, yy, zz], or a 3 × 3 matrix; planar scenes about
    z."""

    refers_to = (("point", "body"),)
