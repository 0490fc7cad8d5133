"""What of a link file which part of stage 1 depends on, and modal bodies from earlier ones with the same modes.

| part | depends on |
|---|---|
| mesh (solids that gmsh meshes: `mesh.kept_parts`) | geometry, mesh, places of interfaces, outlined patches |
| modes, invariants, prestress | the mesh; material, theory, reference condition, attached masses, `[modes]` |
| damping ratios, modal stresses, name, what was measured | the modes; `[damping]`, `[stress]`, `name`, `[measured]` |

NumPy only: no finite element library is needed where the modes stay.
"""

from __future__ import annotations

import hashlib
import json
from collections.abc import Mapping
from dataclasses import asdict, replace
from pathlib import Path
from typing import Any

import numpy as np

from ..common.version import digest_of_code
from ..mesh.kept_parts import digest_of_mesh_code, geometry_content
from .link_records import FAMILIES, BeamLink, Link, SolidLink, read_measured
from .modal_body import ModalBody, StressPoint
from .modal_body.damping import damping_ratio
from .modal_body.lumped_masses import lumps
from .modal_body.measured import as_computed, with_measured

_AFTER_THE_MODES = ("name", "damping", "stress", "measured")


def input_hash(link: Link) -> str:
    """SHA-256 of what a modal body depends on: the link as checked, defaults filled in, and the code that computes it.

    A part's file and a table of measured modes count by their content. Comments, the order of keys, 1 for 1.0, dates
    of files change nothing.
    """
    return _digest(_content(link))


def modes_hash(link: Link) -> str:
    """SHA-256 of what the modes and their invariants depend on."""
    return _digest({key: value for key, value in _content(link).items() if key not in _AFTER_THE_MODES})


def _content(link: Link) -> dict[str, Any]:
    record = link.model_dump(mode="json")
    if isinstance(link, SolidLink):
        record["geometry"] = geometry_content(link.geometry)
    if link.measured is not None:
        record["measured"] = [asdict(row) for row in read_measured(link.measured.table, FAMILIES)]
    return record


def _digest(record: Mapping[str, Any]) -> str:
    content = {"link": record, "fe_models": digest_of_code(Path(__file__).parent), "mesh": digest_of_mesh_code()}
    return hashlib.sha256(json.dumps(content, sort_keys=True).encode()).hexdigest()


def restated(body: ModalBody, link: Link) -> ModalBody | None:
    """The modal body of `link` from one with the same modes; None where that has not all that `link` asks for."""
    body = as_computed(body)
    stress = _stresses(body, link)
    if stress is None or (link.stress.surface and body.surface_static is None):
        return None
    points, loads = stress
    same = replace(
        body,
        name=link.name,
        damping_ratio=damping_ratio(link, np.sqrt(np.diag(body.stiffness))),
        damping_of=link.damping.of,
        stress=points,
        stress_loads=loads if points or link.stress.surface else (),
        surface_stress=body.surface_stress if link.stress.surface else None,
        surface_static=body.surface_static if link.stress.surface else None,
        input_hash=input_hash(link),
    )
    return with_measured(same, link)


def _stresses(body: ModalBody, link: Link) -> tuple[dict[str, StressPoint], tuple[str, ...]] | None:
    """Of a beam they follow from its stations; of a solid, which needs its mesh for them, those there are.

    With the names of the loads whose static stresses they have.
    """
    if isinstance(link, BeamLink):
        from .beam.stress import beam_stresses, stress_loads  # loads SciPy

        attached = lumps(link.interface, body.interfaces)
        of_modes = np.diag(body.stiffness), body.family, attached, body.residual, body.interfaces
        return beam_stresses(link, body.stations, *of_modes), stress_loads(link, body.interfaces)
    known = {tuple(point.position): point for point in body.stress.values() if point.static is not None}
    if not known.keys() >= set(link.stress.points.values()):
        return None
    return {name: known[position] for name, position in link.stress.points.items()}, body.stress_loads
