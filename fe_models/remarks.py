"""What is allowed in a link file but looks like another unit or a slip; a remark each, for nothing here is certain."""

from collections.abc import Iterator
from typing import TYPE_CHECKING, TypeGuard

import numpy as np

if TYPE_CHECKING:  # scenes of rigid bodies do without the records of links
    from .link_records.link import BeamLink, Link

LONGEST = 50.0  # m: booms of concrete pumps and cranes have less
LIGHTEST, HEAVIEST = 1.0, 3e4  # kg/m³: foams have more, osmium has 2.3e4
SLOWEST, FASTEST = 20.0, 5e4  # m/s, √(E/ρ): silicone rubber has 30, diamond 1.8e4
SLOW, QUICK = 0.02, 1e5  # Hz: the first frequency of a link that is clamped at its root
OVERDAMPED = 1.0  # damping ratio: links have less


def remarks_on_link(link: "Link", label: str) -> Iterator[str]:
    """Yield remarks on length, material, damping and mesh of a link, which `label` names."""
    yield from remarks_on_length(link.geometry.length, label)
    if (ratio := float(np.max(link.damping.ratio or 0.0))) >= OVERDAMPED:
        yield f"{label}: a damping ratio of {ratio:g} is above critical damping, 1: is it in percent?"
    if getattr(link.mesh, "order", None) == 1:
        yield f"{label}: cells of order 1 bend too stiffly, by tens of percent; order 2 does not"
    density, modulus = link.material.density, float(np.max(link.material.youngs_modulus))
    if not LIGHTEST <= density <= HEAVIEST:
        yield f"{label}: density {density:g} kg/m³: units are SI; is it in g/cm³ or t/mm³?"
    elif not SLOWEST <= (speed := np.sqrt(modulus / density)) <= FASTEST:
        likely = "density in g/cm³" if speed > FASTEST else "it in MPa or GPa"
        yield (
            f"{label}: youngs_modulus {modulus:g} Pa, at {density:g} kg/m³ a speed of sound of {speed:.2g} m/s: units"
            f" are SI; is {likely}?"
        )
    elif is_beam(link):
        yield from _beam(link, label)


def is_beam(link: "Link | None") -> "TypeGuard[BeamLink]":
    """Whether `link` is a beam, and not None."""
    return link is not None and link.geometry.kind == "beam"


def _beam(link: "BeamLink", label: str) -> Iterator[str]:
    """Of sections that are wider than the link is long, and of its lowest frequency as a cantilever."""
    section, length = link.sections[0], link.geometry.length
    if (widest := max(section.height, section.width)) > length:
        yield f"{label} has a section of {widest:g} m at a length of {length:g} m: units are SI; is it in mm?"
        return
    EI = min(section.I_yy, section.I_zz) * link.material.youngs_modulus
    frequency = 0.56 / length**2 * np.sqrt(EI / (link.material.density * section.area))
    if not SLOW <= frequency <= QUICK and length <= LONGEST:
        yield (
            f"{label} vibrates at {frequency:.2g} Hz as a cantilever: units are SI; is a length in mm, or the modulus"
            " in MPa?"
        )


def remarks_on_length(length: float, label: str) -> Iterator[str]:
    """Yield a remark on an implausible length, m, of what `label` names."""
    if length > LONGEST:
        yield f"{label} is {length:g} m long: units are SI; is this in mm?"
