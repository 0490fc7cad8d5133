"""The modal body of a link of either kind, from what its finite element model has computed."""

from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np

from ...common.arrays import Array
from ...common.version import VERSION
from ..link_records.link import Link
from .body import ModalBody
from .lumped_masses import Lump, with_lumped_masses, with_lumped_stiffness
from .measured import damping_ratio
from .parts import Interface, Invariants
from .unit_loads import unit_load_names


def modal_body_of(
    link: Link,
    omega2: Array,
    families: Sequence[str],
    eigenmodes: int,
    interfaces: Mapping[str, Interface],
    attached: Sequence[Lump],
    *,
    integrals: Invariants,
    geometric_stiffness: Array,
    **others: Any,
) -> ModalBody:
    """The modal body of `link`, its hashes left empty, of so many `eigenmodes`, then attachment modes, ω² (n,) rad²/s².

    `integrals` and `geometric_stiffness` (l, n, n), rad²/s² by unit load, are those without the `attached` lumps;
    `others` are further fields.
    """
    omega = np.sqrt(omega2)
    return ModalBody(
        name=link.name,
        kind=link.geometry.kind,
        reference_condition=link.reference.condition,
        length=link.geometry.length,
        **vars(with_lumped_masses(integrals, attached)),
        frequency=omega / (2 * np.pi),
        stiffness=np.diag(omega2),
        damping_ratio=damping_ratio(link, omega),
        damping_of=link.damping.of,
        family=tuple(families),
        residual=np.repeat([0, 1], [eigenmodes, omega.size - eigenmodes]),
        geometric_stiffness=with_lumped_stiffness(geometric_stiffness, unit_load_names(interfaces), attached),
        interfaces=interfaces,
        stress_loads=stress_loads(link, interfaces),
        ffrobot_version=VERSION,
        **others,
    )


def stress_loads(link: Link, interfaces: Mapping[str, Interface]) -> tuple[str, ...]:
    """Names of the unit loads whose static stresses are stored; none where no stresses are."""
    return tuple(unit_load_names(interfaces)) if link.stress.points or link.stress.surface else ()
