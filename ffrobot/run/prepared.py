"""A scene ready for its analyses: its equations, bodies and patches, and what of it they leave out."""

from collections import Counter
from collections.abc import Iterator, Mapping
from dataclasses import field
from typing import TYPE_CHECKING

import numpy as np

from ..common.structs import struct
from ..fe_models.modal_body import ModalBody
from ..mbs.model.body import Body
from ..mbs.model.model import Model
from ..mbs.model.projection import vanishing_in_plane
from ..mbs.model.truncation import modes_kept
from ..scene.pieces import BodyInPieces
from ..scene.scene import Scene
from .bodies import LoadedBody, links_of

if TYPE_CHECKING:  # most scenes have none of these
    from ..actuation.patches.link_patches import LinkPatches
    from ..actuation.points import PointSet


@struct
class Prepared:
    """A scene in space before its analyses."""

    # the scene and its equations
    scene: Scene
    model: Model
    bodies: Mapping[str, LoadedBody]  # by name
    patches: "Mapping[str, LinkPatches]"  # by body
    points: "Mapping[str, PointSet]" = field(default_factory=dict)  # actuation points, by body
    # bodies in pieces by name; then `model` is that of the pieces, whose bodies are `parts`, and `whole` that of the
    # links
    divided: Mapping[str, BodyInPieces] = field(default_factory=dict)
    parts: Mapping[str, LoadedBody] = field(default_factory=dict)
    whole: Model | None = None
    stiffened: bool = False  # whether all links have geometric stiffening
    # "ANALYSIS/NAME" of the datasets and groups to which results are limited; None: all
    wanted: frozenset[str] | None = None

    def wants(self, name: str) -> bool:
        """Whether the results file has the dataset or group `name`, or a part of it."""
        whole = f"{name}/"
        return self.wanted is None or any(
            f"{one}/".startswith(whole) or whole.startswith(f"{one}/") for one in self.wanted
        )

    @property
    def links(self) -> dict[str, ModalBody]:
        """The modal bodies of the flexible bodies, as their files have them."""
        return links_of(self.bodies)

    @property
    def solved_links(self) -> dict[str, ModalBody]:
        """The modal bodies in the equations: pieces in place of divided links."""
        return links_of(self.parts or self.bodies)

    @property
    def is_stiffened(self) -> bool:
        """Whether geometric stiffening is in the equations, of all links or of those in pieces."""
        return self.stiffened or any(node.body.stiffening is not None for node in self.model.tree.nodes)

    @property
    def omissions(self) -> tuple[str, ...]:
        """Parts of the equations that a planar scene omits, one line each."""
        return tuple(omissions(self.scene, self.bodies)) if self.scene.is_planar else ()

    @property
    def notes(self) -> tuple[str, ...]:
        """Notes on motions that links cannot perform, and on omitted modes, one line each."""
        left_out = (
            f"{name}: all modes but {modes_kept(body.spatial)}"
            for name, body in self.bodies.items()
            if body.spatial.reduction is not None and not self.scene.is_planar
        )
        return (*self.link_notes, *left_out)

    @property
    def link_notes(self) -> tuple[str, ...]:
        """Notes on motions that links cannot perform, and on their meshes, one line each."""
        reasons = {"rigid_in": "its file has no modes", "without_coordinate": "its equations keep none of the modes"}
        rigid = (
            f"{name}: rigid in {', '.join(motions)}, of which {reason}"
            for key, reason in reasons.items()
            for name, body in self.bodies.items()
            if (motions := getattr(body, key))
        )
        remarks = (f"{name}: {text}" for name, modal in self.links.items() for text in modal.remarks)
        return (*rigid, *remarks, *self._off_axis())

    def _off_axis(self) -> Iterator[str]:
        """Patches without a face on links whose faces are not at equal distances from the axis."""
        for array in (array for of_link in self.patches.values() for array in of_link.arrays.values()):
            layout, stations = array.layout, self.links[array.layout.body].stations
            if layout.face is not None or stations.middle is None:
                continue
            between, axis = (stations.height, 0) if layout.normal == "y" else (stations.width, 1)
            assert between is not None
            x = stations.position[:, 0]
            under = (x < array.edges[:, 1:]) & (np.append(x[1:], x[-1]) > array.edges[:, :1])
            off = np.where(under.any(axis=0), np.abs(stations.middle[:, axis]), 0.0)
            if (off > OFF_AXIS * between).any():
                yield (
                    f'pzt "{layout.label}": the axis of "{layout.body}" is up to {1e3 * off.max():.2g} mm off the'
                    " middle between its faces, where patches without face have the same arm on both: name the face"
                )


_STAGE_1 = {"modes": "stage 1 but for damping, stresses and name", "mesh": "the mesh, which is that of an earlier run"}

OFF_AXIS = 0.01  # of the extent: less is that of a mesh
RIGID = 1e-9  # of the motion across: less along the axis is round-off

_TERMS = {
    "D_ff": "damping",
    "S_tilde": "inertia between rotation and pairs of modes",  # S̃
    "j": "change of inertia to first order in deflections",  # j
}


def omissions(scene: Scene, bodies: Mapping[str, LoadedBody]) -> Iterator[str]:
    """Yield one line for each effect that a planar scene omits."""
    of = {name: body.spatial for name, body in bodies.items()}
    for name, body in bodies.items():
        if body.modal is None:
            continue
        if not body.computed:
            yield f"{name}: stage 1, up to date"
        elif body.reused:
            yield f"{name}: {_STAGE_1[body.reused]}"
        yield from _modes(name, of[name], body.modal)
    flexible = [name for name, body in bodies.items() if body.modal is not None]
    rigid = [name for name in bodies if name not in flexible]
    if rigid:
        yield f"modal coordinates of {', '.join(rigid)}, rigid"
    yield "out-of-plane motion"
    stiff = []  # no force at a point moves any point along the axis, where joints and weight load it
    for name in flexible:
        along, across, _ = zip(*(point.translation for point in of[name].points.values()), strict=True)
        if np.abs(along).max(initial=0.0) <= RIGID * np.abs(across).max(initial=0.0):
            stiff.append(name)
    if stiff:
        yield f"axial deformation of {', '.join(stiff)}: no axial modes in [modes] family"
    for term, symbol in _TERMS.items():
        zero = [name for name, body in of.items() if term in vanishing_in_plane(body)]
        if zero:
            whose = "" if zero == flexible else f" of {', '.join(zero)}"
            yield f"{symbol}{whose}, which is zero"
    algebraic = [analysis.name for analysis in scene.analysis if analysis.is_algebraic]
    if algebraic:
        yield f"integration of {', '.join(algebraic)}, algebraic"


def _modes(name: str, body: Body, modal: ModalBody) -> Iterator[str]:
    """Modes that do not move in the plane, and those left out by choice."""
    idle = np.flatnonzero(~body.whole.modal_transform.any(axis=1))
    if idle.size:
        families = Counter(modal.family[k] for k in idle)
        named = ", ".join(f"{count} {family}" for family, count in families.items())
        yield f"{name}: {idle.size} of {modal.mode_count} modes, without in-plane motion ({named})"
    if body.reduction is not None:
        yield f"{name}: all modes but {modes_kept(body)}"
