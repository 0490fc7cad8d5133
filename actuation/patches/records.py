"""Patches of a scene file, key by key, their amplifiers and hysteresis, and one layer of them by itself. SI units."""

import json
from collections.abc import Iterator, Sequence
from functools import lru_cache
from typing import Annotated, Literal, NamedTuple, Self

import numpy as np
from pydantic import Field, model_validator

from ...common.arrays import Array
from ...common.errors import quoted
from ...common.keys import MOST_PATCHES, SMALLEST
from ...common.validation import Record
from ...mbs.fields.field_types import Name, NotEmpty, NotNegative, PatchCount, Positive, Quantity, Reference, one_of
from ...mbs.fields.spelling import IN_SPACE, Spelled
from ...mbs.model.amplifiers import MOST_PLAYS, Amplifiers

Face = Literal["+y", "-y", "+z", "-z", "both"]
FACES = {"in-plane": ("+y", "-y", "both"), "out-of-plane": ("+z", "-z", "both")}
OF_FIBRES = ("fibre_angle", "d33", "modulus_across", "shear_modulus", "poissons_ratio")
NO_SHEAR = 1e-9  # of the other stress: a layer that shears less does not twist

Each = Positive | Annotated[tuple[Positive, ...], NotEmpty]
Range = tuple[float, float]


class Amplifier(Record):
    """Amplifier of the patches of a layout, each key with one value for all patches or a list with one for each.

    The largest current limits C dV/dt and the charge of the strain together. `tracking` and `feasibility` take range,
    current and slew rate as limits; forward runs with `limits = true` and closed-loop control cut voltages at them.
    Bandwidth and delay act in both.
    """

    range: Range | Annotated[tuple[Range, ...], NotEmpty] | None = None
    """Smallest and largest voltage, V, such as [-50.0, 200.0]; default: plus and minus `limit`."""
    current: Each | None = None
    """Largest current, A."""
    slew: Each | None = None
    """Largest rate of the voltage, V/s."""
    bandwidth: Each | None = None
    """Bandwidth of first order, Hz."""
    delay: NotNegative | Annotated[tuple[NotNegative, ...], NotEmpty] = 0.0
    """Delay of the voltage, s."""

    @model_validator(mode="after")
    def _consistent(self) -> Self:
        for lowest, highest in np.reshape(() if self.range is None else self.range, (-1, 2)):
            if not lowest < 0.0 < highest:
                raise ValueError(
                    "range: expected a negative and a positive voltage, as patches are at 0 V where the robot rests,"
                    f" found [{lowest:g}, {highest:g}]"
                )
        return self

    def lists(self) -> Iterator[tuple[str, int]]:
        """Yield each key with a list, and the length of the list."""
        for key in type(self).model_fields:
            if np.ndim(value := getattr(self, key)) == (2 if key == "range" else 1):
                yield key, len(value)


class HysteresisKeys(Record):
    """Hysteresis of the patches of a layout in forward runs, closed-loop control and loads: play operators.

    Under a voltage V a patch acts as under Σ w z: z follows V at the distance of a threshold. The other analyses plan
    without it.
    """

    weights: Annotated[tuple[Positive, ...], Field(min_length=1, max_length=MOST_PLAYS)]
    """Weights w."""
    thresholds: tuple[NotNegative, ...]
    """Thresholds, V, ascending from 0."""
    compensate: bool = False
    """Inverse of the hysteresis in front of computed voltages and of controllers."""

    @model_validator(mode="after")
    def _consistent(self) -> Self:
        if len(self.thresholds) != len(self.weights):
            raise ValueError(f"expected {len(self.weights)} thresholds, as weights, found {len(self.thresholds)}")
        if self.thresholds[0] != 0.0 or min(np.diff(self.thresholds), default=1.0) <= 0.0:
            raise ValueError(f"thresholds: expected ascending voltages from 0 on, found {list(self.thresholds)}")
        return self


class Lamina(NamedTuple):
    """Stress (σ_x, τ_xs) = C (ε_x, γ_xs) − C Λ V, Pa, of one layer; x along the link, s across it in the layer."""

    C: Array  # (2, 2) Pa
    per_volt: Array  # (2,) C Λ, Pa/V, with the free strains Λ of a volt
    energy: float  # (C Λ) Λ, Pa/V²: what a clamped layer lacks of its permittivity times the field of a volt, squared

    @property
    def shears(self) -> bool:
        """Whether the layer resists shear, or a voltage shears it."""
        return bool(self.C[:, 1].any() or self.per_volt[1])


@lru_cache
def plain_lamina(
    modulus: float, d31: float, thickness: float, nu: float | None = None, *, held: bool = False
) -> Lamina:
    """Lamina of a ceramic isotropic in its plane: `modulus` (Pa), `d31` (m/V), electrodes `thickness` (m) apart.

    Its free strain is alike in all directions: it never shears. Free across the link, its constants are E and
    E d31; `held` across (ε_s = 0), with Poisson's ratio `nu`, E/(1 − ν²) and E d31/(1 − ν). A link that stands still
    holds it in both directions.
    """
    ratio, stress = nu or 0.0, modulus * d31 / thickness
    across = ratio if held else 0.0
    C, per_volt = np.diag([modulus / (1.0 - across**2), 0.0]), np.array([stress / (1.0 - across), 0.0])
    return Lamina(C, per_volt, stress * d31 / thickness * (1.0 if nu is None else 2.0 / (1.0 - ratio)))


@lru_cache
def fibre_lamina(
    *, E_1: float, E_2: float, G_12: float, nu_12: float, d33: float, d31: float, angle: float, spacing: float
) -> Lamina:
    """Lamina of parallel fibers at an `angle` (rad) from x, σ_s = 0: transformed compliances (Jones 1999, 2.6).

    Moduli in Pa, d33 along and d31 across the fibers in m/V; a volt is a field of 1/`spacing`, 1/m.
    """
    c, s = np.cos(angle), np.sin(angle)
    S_11, S_22, S_12, S_66 = 1 / E_1, 1 / E_2, -nu_12 / E_1, 1 / G_12
    S_xx = S_11 * c**4 + (2 * S_12 + S_66) * s**2 * c**2 + S_22 * s**4
    S_xs = (2 * S_11 - 2 * S_12 - S_66) * s * c**3 - (2 * S_22 - 2 * S_12 - S_66) * s**3 * c
    S_ss = 2 * (2 * S_11 + 2 * S_22 - 4 * S_12 - S_66) * s**2 * c**2 + S_66 * (s**4 + c**4)
    C = np.linalg.inv(np.array([[S_xx, S_xs], [S_xs, S_ss]]))
    free = np.array([d33 * c**2 + d31 * s**2, 2 * (d33 - d31) * s * c]) / spacing
    return Lamina(C, C @ free, float(free @ C @ free))


class PztLayout(Record):
    """Equal piezoelectric patches along one link; several layouts on a body have names.

    Layers on both faces have opposite voltages. A positive voltage bends towards +y or +z (with d31 > 0), or twists by
    a positive angle. With their stiffness patches bend the link like a composite section; in Shabana 2022 they add
    none. No voltage drives patches with open or shorted `electrodes`, or a `shunt`.

    Plain ceramic has one modulus and d31. Macro fiber composites have `fibre_angle`, d33 and `modulus` along the
    fibers, d31 and `modulus_across` across them, `shear_modulus` and `poissons_ratio`. Fibers at an angle wind around
    the link, that is, lie at the same angle on both faces seen from outside.
    """

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
    offset: Annotated[float, IN_SPACE] = 0.0
    """Middle of the patch across the width, m from the axis of the link: z of faces ±y, y of faces ±z."""
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
    amplifier: Amplifier | None = None
    """Amplifier of the patches."""
    hysteresis: HysteresisKeys | None = None
    """Hysteresis of the patches."""
    permittivity: Positive = 1700 * 8.8541878128e-12
    """Permittivity along the field at constant stress, F/m, for the capacitance; default: that of PZT-5A."""
    layers: Annotated[int, Field(gt=0, le=1000)] = 1
    """Number of stacked layers."""
    face: Annotated[Face | None, Spelled(Literal["+y", "-y", "both"])] = None
    """Face of the link; without it patches only bend or twist the link."""
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
    name: Name | None = None
    """Name of the layout in results; default: the name of the body."""
    bends: Annotated[Literal["in-plane", "out-of-plane", "twist"], IN_SPACE] = "in-plane"
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
    poissons_ratio: float | None = None
    """Poisson's ratio −s12/s11 of the ceramic in its plane, for `strain`; of fibers under tension along them."""
    strain: Literal["uniaxial", "biaxial"] | None = None
    """Strain across the patch: free, with d31/s11, or none, with d31/(s11 + s12); default: none on links at least
    three times as wide as long, and on outlined faces, where `poissons_ratio` is given."""
    electrodes: Literal["driven", "open", "shorted"] = "driven"
    """Electrodes of the patches: driven by voltages, not connected, or connected with each other."""
    shunt: Positive | None = None
    """Resistor across the electrodes of each patch, Ω, instead of a voltage."""
    electrode_spacing: Annotated[Positive | None, IN_SPACE] = None
    """Spacing of interdigitated electrodes, m; the field per volt is its inverse; default: thickness of a layer."""

    @model_validator(mode="after")
    def _consistent(self) -> Self:
        one_of(self, ("count", "centers"))
        self._check_constants()
        if isinstance(self.limit, tuple) and len(self.limit) != self.patch_count:
            raise ValueError(f"expected {self.patch_count} limits, one for each patch, found {len(self.limit)}")
        for key, found in self.amplifier.lists() if self.amplifier is not None else ():
            if found != self.patch_count:
                raise ValueError(
                    f"amplifier: {key}: expected {self.patch_count} values, one for each patch, found {found}"
                )
        if self.limit is not None and self.amplifier is not None and self.amplifier.range is not None:
            raise ValueError('expected one of the keys "limit" and "amplifier.range", found both')
        uses = self.amplifier is not None or "permittivity" in self.model_fields_set or self.gives_way
        if uses and self.capacitance(clamped=True) <= 0.0:
            least = self.permittivity * (1.0 - self.capacitance(clamped=True) / self.capacitance())
            raise ValueError(
                f"expected a permittivity above {least:.4g} F/m, the square of the piezoelectric constant times the"
                f" modulus, which leaves the energy positive, found {self.permittivity:g}"
            )
        self._check_electrodes()
        if self.adds_mass and self.density is None:
            structural = "true" if self.structural is True else json.dumps(list(self.structural or ()))
            raise ValueError(f'expected the key "density" with structural = {structural}, found none')
        if self.mode_weights is not None and self.point_weights is not None:
            raise ValueError('expected one of the keys "mode_weights" and "point_weights", found both')
        for weights in (self.mode_weights, self.point_weights and tuple(self.point_weights.values())):
            if weights is not None and not any(weights):
                raise ValueError("expected weights that are not all 0, found only zeros")
        return self

    def _check_constants(self) -> None:
        """Raise `ValueError` for patches without effect, or with another one than `bends` says."""
        given = [key for key in (*OF_FIBRES[:-1], "electrode_spacing") if getattr(self, key) is not None]
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
        if self.offset and (self.face is None or self.coupling == "surface"):
            found = "none" if self.face is None else 'coupling = "surface"'
            raise ValueError(f'expected a face and coupling = "rotation" with an offset, found {found}')

    def capacitance(self, *, clamped: bool = False) -> float:
        """The capacitance of one patch with all layers and faces, F: free to strain, or clamped."""
        volume = self.length * self.width * self.thickness * self.layers * (2 if self.face == "both" else 1)
        return volume * (self.permittivity / self.spacing**2 - (self.lamina.energy if clamped else 0.0))

    def amplifiers(self) -> Amplifiers:
        """The amplifiers of all k patches, with their hysteresis."""
        of, k = self.amplifier or Amplifier(), self.patch_count

        def each(value: float | tuple[float, ...] | None) -> Array:
            return np.broadcast_to(np.inf if value is None else np.asarray(value, dtype=float), k)

        limit = each(self.limit)
        range = np.stack([-limit, limit]) if of.range is None else np.broadcast_to(np.array(of.range), (k, 2)).T
        plays, hysteresis = np.zeros((2, MOST_PLAYS, k)), self.hysteresis
        given = ((1.0,), (0.0,)) if hysteresis is None else (hysteresis.weights, hysteresis.thresholds)
        plays[:, : len(given[0])] = np.array(given)[:, :, None]
        return Amplifiers(
            range=range,
            slew=each(of.slew),
            current=each(of.current),
            capacitance=self.capacitance(clamped=True) * np.eye(k),
            bandwidth=each(of.bandwidth),
            delay=each(of.delay),
            plays=plays,
            compensated=each(float(hysteresis is not None and hysteresis.compensate)),
        )

    def with_one_limit(self, **changes: object) -> Self:
        """A changed copy with one range of voltages for all patches, whose number may change."""
        lowest, highest = self.amplifiers().range
        of_all = Amplifier.model_construct(range=(float(lowest.max()), float(highest.min())))
        return self.model_copy(update={"limit": None, "amplifier": of_all, "allocation": "least-squares", **changes})

    def _check_plain(self) -> None:
        if abs(self.d31) < SMALLEST:
            raise ValueError(f"expected a d31 other than 0, found {self.d31:g}: such patches have no effect")
        if self.poissons_ratio is not None and not -1.0 < self.poissons_ratio < 1.0:
            raise ValueError(f"expected a poissons_ratio between -1 and 1, found {self.poissons_ratio:g}")
        if self.strain == "biaxial" and self.poissons_ratio is None:
            raise ValueError('expected the key "poissons_ratio" with strain = "biaxial", found none')
        if self.bends == "twist":
            raise ValueError(
                f'expected the keys {quoted(OF_FIBRES)} with bends = "twist", found none: plain piezoceramic strains'
                " alike in all directions of its plane and twists at no angle; fibers (macro fiber composites) do"
            )

    def _check_electrodes(self) -> None:
        """Raise `ValueError` for keys that patches which no voltage drives cannot have."""
        if self.shunt is not None and "electrodes" in self.model_fields_set:
            raise ValueError(f'expected a shunt in the place of electrodes = "{self.electrodes}", found both')
        if self.is_driven:
            return
        what = f'electrodes = "{self.electrodes}"' if self.shunt is None else "a shunt"
        for key in ("limit", "amplifier", "hysteresis", "mode_weights", "point_weights"):
            if getattr(self, key) is not None:
                raise ValueError(f'expected no "{key}" with {what}, which takes no voltage, found one')
        if not (self.adds_stiffness and self.face and self.coupling == "rotation"):
            raise ValueError(
                f'expected a face, structural with "stiffness" and coupling = "rotation" with {what}, found others'
            )

    def _check_fibres(self, given: list[str]) -> None:
        missing = [key for key in OF_FIBRES if getattr(self, key) is None]
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
            raise ValueError("expected d33 or d31 other than 0, found neither: such patches have no effect")
        if self.bends == "twist" and shear <= NO_SHEAR * along:
            raise ValueError(
                f'expected fibers at an angle that shear under a voltage with bends = "twist", found fibre_angle ='
                f" {self.fibre_angle:g} with d33 = {self.d33:g}, d31 = {self.d31:g}: along, across or alike in both"
                " directions they do not; 45*deg does most"
            )

    @property
    def label(self) -> str:
        """Name of the layout in results and messages."""
        return self.body if self.name is None else self.name

    @property
    def normal(self) -> Literal["y", "z"]:
        """Axis of the link along the normal of the patches' faces."""
        return "z" if self.bends == "out-of-plane" or self.face in ("+z", "-z") else "y"

    @property
    def lamina(self) -> Lamina:
        """Elastic and piezoelectric constants of one layer."""
        if self.fibre_angle is None:
            held = self.strain == "biaxial" and self.coupling == "rotation"
            return plain_lamina(self.modulus, self.d31, self.thickness, self.poissons_ratio, held=held)
        return fibre_lamina(
            E_1=self.modulus,
            E_2=self.modulus_across or 0.0,
            G_12=self.shear_modulus or 0.0,
            nu_12=self.poissons_ratio or 0.0,
            d33=self.d33 or 0.0,
            d31=self.d31,
            angle=self.fibre_angle,
            spacing=self.spacing,
        )

    @property
    def spacing(self) -> float:
        """Distance of the electrodes of a layer, m."""
        return self.electrode_spacing or self.thickness

    @property
    def is_driven(self) -> bool:
        """Return whether voltages drive the patches."""
        return self.electrodes == "driven" and self.shunt is None

    @property
    def gives_way(self) -> bool:
        """Whether the strain of the link charges the patches: their electrodes are open, or behind a resistor."""
        return self.electrodes == "open" or self.shunt is not None

    @property
    def adds_mass(self) -> bool:
        """Whether the mass of the patches is part of the link."""
        return self.structural is True or "mass" in (self.structural or ())

    @property
    def adds_stiffness(self) -> bool:
        """Whether the stiffness of the patches is part of the link."""
        return self.structural is True or "stiffness" in (self.structural or ())

    @property
    def patch_count(self) -> int:
        """Number of patches along the link."""
        return len(self.centers) if self.centers is not None else (self.count or 0)

    def references(self) -> Iterator[Reference]:
        """Yield references to the link and to its points with `point_weights`."""
        yield Reference("body", self.body)
        yield Reference("body", self.body, "flexible body")
        for point in self.point_weights or ():
            yield Reference("point_weights", f"{self.body}.{point}")


def by_body(layouts: Sequence[PztLayout]) -> Iterator[tuple[str, list[PztLayout]]]:
    """Yield each body with patches and its layouts, in the order of first layouts."""
    for body in dict.fromkeys(layout.body for layout in layouts):
        yield body, [layout for layout in layouts if layout.body == body]
