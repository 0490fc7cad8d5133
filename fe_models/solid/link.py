"""From a solid's link file to its modal body: mesh, supports, modes, integrals. Importing this loads dolfinx."""

from collections.abc import Mapping
from pathlib import Path

import numpy as np
from dolfinx import fem

from ...common.arrays import Array, Integers
from ...common.errors import InputError

# First of all that load dolfinx: mesh.compat sets PETSc up.
from ...mesh.compat import lagrange_element, node_map
from ...mesh.part import Progress
from ...mesh.records import default_order
from ...mesh.solid_mesh import SolidMesh, solid_mesh
from ...mesh.structured import with_points
from ..link_records.families import HOLDING_ROOT
from ..link_records.link import SolidLink
from ..modal_body import Interface, ModalBody, PictureMesh, Stations
from ..modal_body.attachment_modes import moving
from ..modal_body.craig_bampton import ROOT, FixedInterfaceFlexibility
from ..modal_body.lumped_masses import loads_with_lumps, lump_weights, lumps
from ..modal_body.measured import canonical_signs
from ..modal_body.of_link import modal_body_of
from ..modal_body.unit_loads import unit_load_names
from .elasticity import MassMatrix, MaterialMap, SolidModel, material_map, solid_model
from .functionals import Averages, face_averages, outlined_patches, section_averages
from .invariants import prestressed, shape_integrals, static_shapes, unit_loads
from .modes import attachment_modes, ritz_modes, section_motion, wanted_modes
from .stress import recovered_stresses
from .supports import Flexibility, RigidFace

# Cubic elements of the stations: as many as there are cells along the axis, within these bounds.
ELEMENTS = (20, 40)
# Of the extents: by less the middle between faces is on the axis.
ROUND_OFF = 1e-9

# Components (translation 0 … 2, rotation 3 … 5) that each reference condition holds at root and tip.
_CLAMPED: dict[str, tuple[int, ...]] = {"root": (0, 1, 2, 3, 4, 5), "tip": ()}
SUPPORTS = {**dict.fromkeys(HOLDING_ROOT, _CLAMPED), "simply-supported": {"root": (0, 1, 2, 3), "tip": (1, 2)}}


def solid_modal_body(link: SolidLink, path: Path, progress: Progress, *, remesh: bool = False) -> ModalBody:
    """Compute the modal body of `link`, read from `path`; collective, the same on all processes.

    A mesh kept from an earlier run is used unless `remesh`. The hashes are left empty. Raises `InputError` where the
    part cannot be meshed, a face is missing, or more modes are asked for than the mesh has; `SolveError` where the
    stiffness cannot be factorized, or the eigensolver did not converge.
    """
    solid = solid_mesh(link.part(path), progress, remesh=remesh)
    progress(f"{link.name}: assembling")
    model = solid_model(solid.mesh, link.mesh.order or default_order(solid.part.cell), _materials(link, solid, path))
    averages = _averages(link, model, solid)
    rows = {name: one.rows(model)[0] for name, one in averages.items()}
    x, element = _station_grid(link, solid)
    sections = section_averages(model, x)
    progress(f"{link.name}: factorizing {3 * model.V.dofmap.index_map.size_global} unknowns")
    flexibility = _supported(link, model, solid, averages, rows, path)
    weights = {record.name: lump_weights(record.mass, record.inertia) for record in link.interface}
    mass = MassMatrix(model, [(rows[name], w) for name, w in weights.items() if np.any(w)])
    progress(f"{link.name}: solving for the static shapes")
    loads = unit_loads(model, rows)
    shapes = static_shapes(flexibility, loads)
    progress(f"{link.name}: solving for the modes")
    fixed = link.reference.condition == "craig-bampton"
    of_others = [B[moving(link.families)] for name, B in rows.items() if name != ROOT]
    modes = wanted_modes(
        link,
        FixedInterfaceFlexibility(flexibility, np.concatenate(of_others), model.total) if fixed else flexibility,
        mass,
        lambda X: section_motion(
            sections,
            x,
            element,
            *sections.of(model, X),
            [(model.total(B @ X), weights) for B, weights in mass.attached],
        ),
        str(path),
    )
    flexibility.release()
    count = modes.omega2.size
    if link.modes.attachment_modes:
        progress(f"{link.name}: adding the attachment modes")
        length, count_at = link.geometry.length, len(rows)
        residual = attachment_modes(
            link.families, mass, modes, loads, shapes, interfaces=count_at, length=length, twists_along=not fixed
        )
        modes = modes.followed_by(residual)
    if fixed:
        modes = ritz_modes(model, modes, count)
    progress(f"{link.name}: integrating the inertia")
    translation, rotation = sections.of(model, modes.X)
    signs = canonical_signs(np.concatenate([translation, rotation], axis=1).transpose(1, 0, 2))
    X = modes.X * signs
    seen = model.with_ghosts(X)
    interfaces = {}
    for name, one in averages.items():
        shift, turn = one.of(model, X)
        interfaces[name] = Interface(one.centroid[0], shift[0], turn[0], link.couplings[name])
    attached = lumps(link.interface, interfaces)
    progress(f"{link.name}: integrating the geometric stiffness")
    supports = {} if link.coupling == "rigid" else SUPPORTS[link.reference.condition]
    stiffness = prestressed(flexibility, X, loads, shapes, rows=rows, interfaces=interfaces, supports=supports)
    mesh = _picture(solid, model, seen)
    with_lumps = loads_with_lumps(unit_load_names(interfaces), attached)
    recovered = recovered_stresses(link, model, seen, shapes @ with_lumps, mesh.points, path)
    patches = None
    if link.surface_patch:
        of_faces = model.V, solid.facet_tags, solid.part.faces, link.surface_patch
        patches = outlined_patches(*of_faces, length=link.geometry.length, modes=seen)
    body = modal_body_of(
        link,
        modes.omega2,
        modes.families,
        count,
        interfaces,
        attached,
        integrals=shape_integrals(model, X),
        geometric_stiffness=stiffness,
        modal_mass=model.total(X.T @ (mass @ X)),
        stations=_stations(link, sections, x, element, translation * signs, rotation * signs),
        mesh=mesh,
        **recovered,
        surface_patches=patches,
        remarks=tuple(solid.part.remarks),
    )
    model.mass.matrix.destroy()
    return body


def _materials(link: SolidLink, solid: SolidMesh, path: Path) -> MaterialMap:
    """Materials of the cells, by region: of cells of several regions, that of the smallest."""
    for region in link.region:
        if region.group not in solid.part.regions:
            groups = ", ".join(sorted(solid.part.regions)) or "none"
            raise InputError(f"{path}: region.group: expected a volume group of the mesh ({groups})", region.group)
    largest_first = list(solid.part.regions)
    ordered = sorted(link.region, key=lambda region: largest_first.index(region.group))
    for k, region in enumerate(ordered):
        inside = [other.group for other in ordered[k + 1 :]]
        if set(solid.part.tags_of(region.group)) <= {tag for group in inside for tag in solid.part.tags_of(group)}:
            raise InputError(
                f"{path}: region.group of {region.group}: expected a volume group with own cells",
                f"all of them in {', '.join(inside)} too",
            )
    find = solid.cell_tags.find
    regions = [
        (np.concatenate([find(tag) for tag in solid.part.tags_of(region.group)]), region.material) for region in ordered
    ]
    return material_map(solid.mesh, link.material, regions)


def _averages(link: SolidLink, model: SolidModel, solid: SolidMesh) -> dict[str, Averages]:
    """Root, tip and the interfaces of the link file: faces, or cross sections where the position is one number."""
    sections = {record.name: record.position for record in link.interface if isinstance(record.position, float)}
    faces = [name for name in ("root", "tip", *(record.name for record in link.interface)) if name not in sections]
    averages = {name: face_averages(model, solid.facet_tags, solid.part.faces[name]) for name in dict.fromkeys(faces)}
    return averages | {name: section_averages(model, np.array([x])) for name, x in sections.items()}


def _supported(
    link: SolidLink,
    model: SolidModel,
    solid: SolidMesh,
    averages: Mapping[str, Averages],
    rows: Mapping[str, Array],
    path: Path,
) -> Flexibility:
    """The body supported as its reference condition says, faces with rigid coupling made plates."""
    supports = SUPPORTS[link.reference.condition]
    plates = sorted(name for name, coupling in link.couplings.items() if coupling == "rigid")
    faces, taken = [], np.zeros(model.owned, dtype=bool)
    for name in plates:
        nodes = fem.locate_dofs_topological(model.V, 2, solid.facet_tags.find(solid.part.faces[name]))
        own = nodes[nodes < model.owned]
        if model.total(np.array([np.sum(taken[own])]))[0]:
            raise InputError(
                f"{path}: interface.coupling of {name}: expected rigid faces that do not touch each other"
                f" ({', '.join(plates)})",
                'nodes that two of them share: coupling = "mean" lets a face deform',
            )
        taken[own] = True
        supported = supports.get(name, ()) if link.coupling == "rigid" else ()
        free = [component for component in range(6) if component not in supported]
        faces.append(RigidFace(name, own, averages[name].centroid[0], free))
    if link.coupling == "rigid":
        return Flexibility(model, faces, None)
    held = [rows[name][list(components)] for name, components in supports.items()]
    return Flexibility(model, faces, np.concatenate(held))


def _station_grid(link: SolidLink, solid: SolidMesh) -> tuple[Array, Integers]:
    """Stations x (3e + 1,) in m and the four of each cubic element (e, 4); vertices at the middle and at sections."""
    length = link.geometry.length
    elements = int(np.clip(np.ceil(length / solid.size), *ELEMENTS))
    sections = [record.position for record in link.interface if isinstance(record.position, float)]
    vertices = with_points(np.linspace(0.0, length, elements + 1), [0.5 * length, *sections])
    inner = vertices[:-1, None] + np.diff(vertices)[:, None] * np.array([0.0, 1.0, 2.0]) / 3
    element = 3 * np.arange(vertices.size - 1)[:, None] + np.arange(4)
    return np.append(inner.ravel(), length), element


def _stations(link: SolidLink, sections: Averages, x: Array, element: Integers, u: Array, turn: Array) -> Stations:
    """Extents and rigidity from each station on: the mean of its own and the next one's; of the last its own."""

    def onward(values: Array) -> Array:
        return np.append(0.5 * (values[:-1] + values[1:]), values[-1:], axis=0)

    height, width = onward(sections.height), onward(sections.width)
    E = np.ravel(link.material.youngs_modulus)[0]  # of an orthotropic one E_x
    EA, EI_zz, EI_yy = (E * onward(of) for of in (sections.area, *sections.inertia[:, [1, 2], [1, 2]].T))
    middle, extents = onward(sections.middle), np.stack([height, width], axis=1)
    return Stations(
        np.column_stack([x, sections.centroid[:, 1:]]),
        u,
        turn,
        height,
        element,
        rigidity=None if link.region else np.stack([EA, EI_yy], axis=1),
        width=width,
        out_of_plane_rigidity=None if link.region else EI_zz,
        middle=middle if np.any(np.abs(middle) > ROUND_OFF * extents) else None,
    )


def _picture(solid: SolidMesh, model: SolidModel, modes: Array) -> PictureMesh:
    """The surface with what `modes` (3 (owned + ghosts), n) do at its points; collective."""
    surface, n = solid.surface, modes.shape[1]
    shapes = lagrange_element(model.V).tabulate(0, surface.X)[0, :, :, 0]
    local = modes.reshape(-1, 3, n)[node_map(model.V)[surface.cells]]
    displacement = np.zeros((len(surface.points), 3, n))
    displacement[surface.rows] = np.einsum("pd,pdin->pin", shapes, local, optimize=True)
    return PictureMesh(surface.points, surface.triangles, model.total(displacement), surface.edges)
