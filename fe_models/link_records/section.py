"""Properties of beam cross sections, in the link frame: x along the axis, y in-plane, z out of plane. SI units."""

from math import pi, tanh

from ...common.structs import struct


@struct
class Section:
    """A cross section whose principal axes are y and z, through the centroid."""

    area: float  # A in m²
    I_yy: float  # ∫y² dA in m⁴: in-plane bending (displacement along y) works against E I_yy
    I_zz: float  # ∫z² dA in m⁴: out-of-plane bending works against E I_zz
    torsion: float  # J in m⁴, St Venant's torsion constant: twisting works against G J
    height: float  # extent along y, in m
    width: float  # extent along z, in m
    shear: float  # Timoshenko's shear coefficient k, the same along y and z for all shapes here

    @property
    def I_p(self) -> float:
        """Polar moment ∫(y² + z²) dA in m⁴: the inertia of twisting."""
        return self.I_yy + self.I_zz


def rectangle(height: float, width: float, poissons_ratio: float) -> Section:
    """Rectangle of `height` along y and `width` along z, m. Shear coefficient: Cowper 1966, table 1."""
    return Section(
        area=height * width,
        I_yy=width * height**3 / 12,
        I_zz=height * width**3 / 12,
        torsion=_rectangle_torsion(max(height, width), min(height, width)),
        height=height,
        width=width,
        shear=10 * (1 + poissons_ratio) / (12 + 11 * poissons_ratio),
    )


def tube(outer: float, inner: float, poissons_ratio: float) -> Section:
    """Tube of diameters `outer` > `inner` ≥ 0, m; full for inner = 0. Shear coefficient: Cowper 1966, table 1."""
    moment = pi * (outer**4 - inner**4) / 64
    ring = (1 + (inner / outer) ** 2) ** 2
    hole = (inner / outer) ** 2
    nu = poissons_ratio
    return Section(
        area=pi * (outer**2 - inner**2) / 4,
        I_yy=moment,
        I_zz=moment,
        torsion=2 * moment,
        height=outer,
        width=outer,
        shear=6 * (1 + nu) * ring / ((7 + 6 * nu) * ring + (20 + 12 * nu) * hole),
    )


ZETA_5 = 1.0369277551433699  # Σ n⁻⁵


def _rectangle_torsion(long: float, short: float) -> float:
    """J of a rectangle with sides `long` ≥ `short` (Timoshenko & Goodier, Theory of Elasticity, §109, eq. 170).

    Σ tanh(…) n⁻⁵ over odd n is 31/32 ζ(5) less Σ (1 − tanh) n⁻⁵, where tanh is 1 to 1e-16 from the 13th term on.
    """
    series = 31 / 32 * ZETA_5 - sum((1 - tanh(n * pi * long / (2 * short))) / n**5 for n in range(1, 25, 2))
    return long * short**3 / 3 * (1 - 192 / pi**5 * short / long * series)
