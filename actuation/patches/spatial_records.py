"""Patches of a scene in space, key by key: which way they bend their link, and fibres at an angle. SI units."""

from __future__ import annotations

from typing import Annotated, Literal

import numpy as np

from ...common.numbers import SMALLEST
from ...common.validation import quoted
from ...mbs.fields.field_types import Name, Positive, Quantity
from ...mbs.fields.spelling import IN_SPACE, Spelled, as_written
from .lamina import Fibres, Lamina, fibre_lamina
from .records import Bends, Face, PatchKeys

FACES = {"in-plane": ("+y", "-y", "both"), "out-of-plane": ("+z", "-z", "both")}
OF_FIBRES = ("fibre_angle", "d33", "modulus_across", "shear_modulus", "poissons_ratio")
NO_SHEAR = 1e-9  # of the other stress: a layer that shears less does not twist


class SpatialPztLayout(PatchKeys):
    """Equal piezoelectric patches along one link of a 3D scene; several layouts on a body have names.

    Lengths in m, moduli in Pa, d31 and d33 in m/V, density kg/m³, limit in V. Centers are distances along the link from
    its root; `count` places them at (k − ½)·(length of link)/count. Without `face` they only bend or twist the link. A
    positive voltage bends towards +y or +z (with d31 > 0), or twists by a positive angle.

    Plain ceramic has one modulus and d31. Macro fibre composites have `fibre_angle`, d33 and `modulus` along the
    fibers, d31 and `modulus_across` across them, `shear_modulus` and `poissons_ratio`; a volt is a field of
    1/`electrode_spacing`. Fibres at an angle wind around the link, that is, lie at the same angle on both faces seen
    from outside.
    """

    face: Annotated[Face | None, Spelled(Literal["+y", "-y", "both"], as_written)] = None
    """Face of the link; without it patches only bend or twist the link."""
    name: Annotated[Name | None, IN_SPACE] = None
    """Name of the layout in results; default: the name of the body."""
    bends: Annotated[Bends, IN_SPACE] = "in-plane"
    """Deformation: along y by patches on faces ±y, along z by patches on faces ±z, or "twist" about x by fibers at an
    angle, by default on ±y."""
    fibre_angle: Annotated[Quantity | None, IN_SPACE] = None
    """Angle of fibers with the link's axis, rad (or such as "45*deg"); positive: like a right-handed screw."""
    d33: Annotated[float | None, IN_SPACE] = None
    """Piezoelectric strain constant along fibers, m/V."""
    modulus_across: Annotated[Positive | None, IN_SPACE] = None
    """Young's modulus across fibers, Pa; `modulus` is that along them."""
    shear_modulus: Annotated[Positive | None, IN_SPACE] = None
    """Shear modulus of a layer of fibers in its plane, Pa."""
    poissons_ratio: Annotated[float | None, IN_SPACE] = None
    """Poisson's ratio of a layer of fibers under tension along them."""
    electrode_spacing: Annotated[Positive | None, IN_SPACE] = None
    """Spacing of interdigitated electrodes, m; the field per volt is its inverse; default: thickness of a layer."""

    def check_constants(self) -> None:
        """Raise `ValueError` for patches that do nothing, or not what `bends` says."""
        given = [key for key in (*OF_FIBRES, "electrode_spacing") if getattr(self, key) is not None]
        if not given:
            self._check_plain()
        else:
            self._check_fibres(given)
        if self.coupling == "surface" and (given or self.bends != "in-plane"):
            raise ValueError(
                'expected bends = "in-plane" and no fibers with coupling = "surface": link files outline patches of'
                f" plain ceramic on faces ±y alone; found {self.bends if not given else given[0]}"
            )
        allowed = FACES.get(self.bends)
        if self.face is not None and allowed is not None and self.face not in allowed:
            raise ValueError(f'expected face {quoted(allowed)} with bends = "{self.bends}", found "{self.face}"')

    def _check_plain(self) -> None:
        super().check_constants()
        if self.bends == "twist":
            raise ValueError(
                f'expected the keys {quoted(OF_FIBRES)} with bends = "twist", found none: plain piezoceramic strains'
                " alike in all directions of its plane and twists at no angle; fibers (macro fiber composites) do"
            )

    def _check_fibres(self, given: list[str]) -> None:
        missing = [key for key in OF_FIBRES if key not in given]
        if missing:
            raise ValueError(f"expected the keys {quoted(missing)} with {given[0]}, found none")
        assert self.modulus_across is not None
        assert self.poissons_ratio is not None
        most = (self.modulus / self.modulus_across) ** 0.5
        if not abs(self.poissons_ratio) < most:
            raise ValueError(
                f"expected a poissons_ratio between -{most:.4g} and {most:.4g}, which leaves the energy of such moduli"
                f" positive, found {self.poissons_ratio:g}"
            )
        along, shear = np.abs(self.lamina.per_volt)
        if max(along, shear) * self.thickness < SMALLEST:
            raise ValueError("expected d33 or d31 other than 0, found neither: such patches do nothing")
        if self.bends == "twist" and shear <= NO_SHEAR * along:
            raise ValueError(
                f'expected fibers at an angle that shear under a voltage with bends = "twist", found fibre_angle ='
                f" {self.fibre_angle:g} with d33 = {self.d33:g}, d31 = {self.d31:g}: along, across or alike in both"
                " directions they do not; 45*deg does most"
            )

    @property
    def label(self) -> str:
        """What results and messages call the layout."""
        return self.body if self.name is None else self.name

    @property
    def acts_in(self) -> Bends:
        """What the patches do to their link."""
        return self.bends

    @property
    def normal(self) -> Literal["y", "z"]:
        """Of the faces that they sit on: an axis of the link."""
        return "z" if self.bends == "out-of-plane" or self.face in ("+z", "-z") else "y"

    @property
    def lamina(self) -> Lamina:
        """One layer by itself."""
        if self.fibre_angle is None:
            return super().lamina
        values = (self.modulus_across, self.shear_modulus, self.poissons_ratio, self.d33)
        across, shear, ratio, d33 = (0.0 if value is None else value for value in values)
        spacing = self.electrode_spacing or self.thickness
        return fibre_lamina(Fibres(self.modulus, across, shear, ratio, d33, self.d31, self.fibre_angle, spacing))
