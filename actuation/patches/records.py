"""Patches of a scene file, key by key. SI units."""

from __future__ import annotations

import json
from collections.abc import Iterator
from typing import Annotated, Literal, Self

from pydantic import Field, model_validator

from ...common.numbers import MOST_PATCHES, SMALLEST
from ...common.validation import Record
from ...mbs.fields.field_types import Name, NotEmpty, NotNegative, PatchCount, Positive, one_of
from ...mbs.fields.references import Reference
from .lamina import Lamina, plain_lamina

MOST_LAYERS = 1000

Face = Literal["+y", "-y", "+z", "-z", "both"]
Bends = Literal["in-plane", "out-of-plane", "twist"]


class PatchKeys(Record):
    """What patches of planar scenes and of scenes in space have in common: see there."""

    body: str
    """Link with these patches."""
    count: PatchCount | None = None
    """Number of patches, with centers at (k − ½)·length of link / count; alternative: `centers`."""
    centers: Annotated[tuple[float, ...], NotEmpty, Field(max_length=MOST_PATCHES)] | None = None
    """Centers, m from the root."""
    length: Positive
    """Length of a patch along the link, m."""
    width: Positive
    """Width of a patch across the link, m."""
    thickness: Positive
    """Thickness of one layer, m."""
    modulus: Positive
    """Young's modulus, Pa."""
    d31: float
    """Piezoelectric strain constant, m/V."""
    density: Positive | None = None
    """Density, kg/m³, for the mass of the patches."""
    limit: Positive | Annotated[tuple[Positive, ...], NotEmpty] | None = None
    """Largest voltage, V: of all, or of each."""
    layers: Annotated[int, Field(gt=0, le=MOST_LAYERS)] = 1
    """Number of stacked layers."""
    face: Face | None = None
    """Face of the link; without it patches only bend the link."""
    allocation: Literal["exact", "least-squares"] = "exact"
    """Allocation of voltages: exact, or least squares, which allows fewer patches than modes."""
    mode_weights: Annotated[tuple[NotNegative, ...], NotEmpty] | None = None
    """Weights of the squares of unmet modal forces, one per mode."""
    point_weights: dict[Name, NotNegative] | None = None
    """Weights of the squares of remaining deflections, by point of the link."""
    structural: bool | tuple[Literal["mass", "stiffness"], ...] = ("stiffness",)
    """Properties that patches add to the link: true for both; false for neither, with the actuation authority on the
    bare link."""
    depoling_field: Positive | None = None
    """Depoling field of the material, V/m; used by the verdict only."""
    strain_limit: Positive | None = None
    """Strain limit of the material; used by the verdict only."""
    coupling: Literal["rotation", "surface"] = "rotation"
    """Coupling to the link: section rotations at patch ends, or faces outlined in the mesh of a solid."""

    @model_validator(mode="after")
    def _consistent(self) -> Self:
        one_of(self, ("count", "centers"))
        self.check_constants()
        if isinstance(self.limit, tuple) and len(self.limit) != self.patch_count:
            raise ValueError(f"expected {self.patch_count} limits, one for each patch, found {len(self.limit)}")
        if self.adds_mass and self.density is None:
            raise ValueError(f'expected the key "density" with structural = {_toml(self.structural)}, found none')
        if self.mode_weights is not None and self.point_weights is not None:
            raise ValueError('expected one of the keys "mode_weights" and "point_weights", found both')
        for weights in (self.mode_weights, self.point_weights and tuple(self.point_weights.values())):
            if weights is not None and not any(weights):
                raise ValueError("expected weights that are not all 0, found only zeros")
        return self

    def check_constants(self) -> None:
        """Raise `ValueError` for patches that do nothing."""
        if abs(self.d31) < SMALLEST:
            raise ValueError(f"expected a d31 other than 0, found {self.d31:g}: such patches do nothing")

    @property
    def label(self) -> str:
        """What results and messages call the layout."""
        return self.body

    @property
    def acts_in(self) -> Bends:
        """What the patches do to their link."""
        return "in-plane"

    @property
    def served_in_words(self) -> str:
        """Which modes the patches are to serve."""
        return "moves in the plane"

    @property
    def normal(self) -> Literal["y", "z"]:
        """Of the faces that they sit on: an axis of the link."""
        return "y"

    @property
    def lamina(self) -> Lamina:
        """One layer by itself."""
        return plain_lamina(self.modulus, self.d31, self.thickness)

    @property
    def adds_mass(self) -> bool:
        """Whether the mass of the patches is part of the link."""
        return self.structural is True or (not isinstance(self.structural, bool) and "mass" in self.structural)

    @property
    def adds_stiffness(self) -> bool:
        """Whether their stiffness is."""
        return self.structural is True or (not isinstance(self.structural, bool) and "stiffness" in self.structural)

    @property
    def patch_count(self) -> int:
        """Number of patches."""
        return len(self.centers) if self.centers is not None else (self.count or 0)

    def references(self) -> Iterator[Reference]:
        """The link, and the points of it whose deflections weigh."""
        yield Reference("body", self.body)
        yield Reference("body", self.body, "flexible body")
        for point in self.point_weights or ():
            yield Reference("point_weights", f"{self.body}.{point}")


class PztLayout(PatchKeys):
    """Equal piezoelectric patches along one link. Lengths in m, modulus in Pa, d31 in m/V, density kg/m³, limit in V.

    Centers are distances along the link from its root; `count` places them at (k − ½)·(length of link)/count.
    `thickness` is that of one of `layers`, stacked on one `face` or on both, with opposite voltages. Without `face`
    they only bend the link, as in the paper. `limit` is one for all or one for each. `allocation = "least-squares"`
    accepts fewer patches than modes, and uncontrollable modes. If voltages cannot produce all modal forces,
    `mode_weights` weigh the squares of unmet modal forces, `point_weights` the squares of the resulting deflections at
    points of the link. `structural` lists what the patches add to their link: by default stiffness, so that they bend
    it like a composite section; true adds mass, too; false adds nothing, as in the paper. `depoling_field` (V/m) and
    `strain_limit` are limits of the material for the verdict. `coupling`: patches act on the section rotations at their
    ends, or on the faces of a solid that outlines them.
    """

    face: Literal["+y", "-y", "both"] | None = None
    """Face of the link; without it patches only bend the link."""


def _toml(value: bool | tuple[str, ...]) -> str:
    return "true" if value is True else json.dumps(list(value or ()))
