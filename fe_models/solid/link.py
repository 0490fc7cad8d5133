"""From a solid's link file to its modal body: mesh, supports, modes, integrals. Importing this loads dolfinx."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path
from typing import NamedTuple

import numpy as np
from dolfinx import fem
from mpi4py import MPI

from ...common.arrays import Array, Integers, as_floats
from ...common.errors import InputError
from ...common.version import VERSION

# First of all that load dolfinx: mesh.compat sets PETSc up.
from ...mesh.compat import lagrange_element, node_map
from ...mesh.records import default_order
from ...mesh.solid_mesh import SolidMesh, solid_mesh
from ...mesh.structured import with_points
from ..link_records.families import HOLDING_ROOT
from ..link_records.link import Coupling, SolidLink
from ..modal_body import Interface, ModalBody, PictureMesh, Stations
from ..modal_body.damping import canonical_signs, damping_ratio
from ..modal_body.lumped_masses import lump_weights, lumps, with_lumped_loads, with_lumped_masses, with_lumped_stiffness
from .attachment_modes import attachment_modes, fixed_interfaces, ritz_modes
from .elasticity import MassMatrix, MaterialMap, SolidModel, material_map, solid_model
from .families import section_motion
from .functionals import Averages, face_averages, section_averages
from .invariants import prestressed, shape_integrals, static_shapes, unit_loads
from .modes import wanted_modes
from .stress import recovered_stresses
from .supports import Flexibility, RigidFace
from .surface_patches import outlined_patches
from .turned_interfaces import without_their_turn

Progress = Callable[[str], None]

# Cubic elements of the stations: as many as there are cells along the axis, within these bounds.
ELEMENTS = (20, 40)
# Of the extents: by less the middle between faces is on the axis.
ROUND_OFF = 1e-9

# Components (translation 0 … 2, rotation 3 … 5) that each reference condition holds at root and tip.
_CLAMPED: dict[str, tuple[int, ...]] = {"root": (0, 1, 2, 3, 4, 5), "tip": ()}
SUPPORTS = {**dict.fromkeys(HOLDING_ROOT, _CLAMPED), "simply-supported": {"root": (0, 1, 2, 3), "tip": (1, 2)}}


class Interfaces(NamedTuple):
    """The interfaces by name: their mean motion, of modes and as rows B (6, 3 owned), and their couplings."""

    averages: dict[str, Averages]
    rows: dict[str, Array]
    couplings: dict[str, Coupling]

    def motion(self, model: SolidModel, modes: Array) -> dict[str, Interface]:
        """Return the motion of each interface in `modes` (3 (owned + ghosts), n); collective."""
        interfaces = {}
        for name, averages in self.averages.items():
            translation, rotation = averages.of(model, modes)
            interfaces[name] = Interface(averages.centroid[0], translation[0], rotation[0], self.couplings[name])
        return interfaces


def solid_modal_body(
    link: SolidLink, path: Path, progress: Progress, comm: MPI.Comm = MPI.COMM_WORLD, *, remesh: bool = False
) -> ModalBody:
    """Compute the modal body of `link`, read from `path`; collective over `comm`, the same on all its processes.

    A mesh kept from an earlier run is used unless `remesh`. The hashes are left empty. Raises `InputError` where the
    part cannot be meshed, a face is missing, or more modes are asked for than the mesh has; `SolveError` where the
    stiffness cannot be factorized, or the eigensolver did not converge.
    """
    solid = solid_mesh(link.part(path), comm, progress, remesh=remesh)
    progress(f"{link.name}: assembling")
    model = solid_model(solid.mesh, link.mesh.order or default_order(solid.cell), _materials(link, solid, path))
    places = _places(link, model, solid)
    x, element = _station_grid(link, solid)
    sections = section_averages(model, x)
    progress(f"{link.name}: factorizing {3 * model.V.dofmap.index_map.size_global} unknowns")
    flexibility = _supported(link, model, solid, places, path)
    weights = {record.name: lump_weights(record.mass, record.inertia) for record in link.interface}
    mass = MassMatrix(model, [(places.rows[name], w) for name, w in weights.items() if np.any(w)])
    progress(f"{link.name}: solving for the static shapes")
    loads = unit_loads(model, places.rows)
    shapes = static_shapes(flexibility, loads)
    progress(f"{link.name}: solving for the modes")
    fixed = link.reference.condition == "craig-bampton"
    modes = wanted_modes(
        link,
        fixed_interfaces(flexibility, link.families, places.rows) if fixed else flexibility,
        mass,
        lambda X: section_motion(
            sections,
            x,
            element,
            *sections.of(model, model.with_ghosts(X)),
            [(model.total(B @ X), weights) for B, weights in mass.attached],
        ),
        str(path),
    )
    flexibility.release()
    count = modes.omega2.size
    if link.modes.attachment_modes:
        progress(f"{link.name}: adding the attachment modes")
        length, named = link.geometry.length, list(places.rows)
        residual = attachment_modes(
            link.families, mass, modes, loads, shapes, interfaces=named, length=length, twists_along=not fixed
        )
        modes = modes.followed_by(residual)
    if fixed:
        modes = ritz_modes(model, modes, count)
    progress(f"{link.name}: integrating the inertia")
    translation, rotation = sections.of(model, model.with_ghosts(modes.X))
    signs = canonical_signs(np.concatenate([translation, rotation], axis=1).transpose(1, 0, 2))
    X = modes.X * signs
    seen = model.with_ghosts(X)
    interfaces = places.motion(model, seen)
    attached = lumps(link.interface, interfaces)
    integrals = with_lumped_masses(shape_integrals(model, X), attached)
    omega = np.sqrt(modes.omega2)
    progress(f"{link.name}: integrating the geometric stiffness")
    supports = {} if link.coupling == "rigid" else SUPPORTS[link.reference.condition]
    stiffness = without_their_turn(
        prestressed(model, X, shapes),
        flexibility,
        loads,
        shapes,
        rows=places.rows,
        interfaces=interfaces,
        supports=supports,
    )
    mesh = _picture(solid, model, seen)
    recovered = recovered_stresses(link, model, seen, with_lumped_loads(shapes, attached), mesh.points, path)
    return ModalBody(
        name=link.name,
        kind=link.geometry.kind,
        reference_condition=link.reference.condition,
        length=link.geometry.length,
        **vars(integrals),
        frequency=omega / (2 * np.pi),
        stiffness=np.diag(modes.omega2),
        modal_mass=model.total(X.T @ (mass @ X)),
        damping_ratio=damping_ratio(link, omega),
        damping_of=link.damping.of,
        family=tuple(modes.families),
        residual=np.repeat([0, 1], [count, omega.size - count]),
        geometric_stiffness=with_lumped_stiffness(stiffness, attached),
        interfaces=interfaces,
        stations=_stations(link, sections, x, element, translation * signs, rotation * signs),
        mesh=mesh,
        **recovered,
        surface_patches=(
            outlined_patches(
                model.V,
                solid.facet_tags,
                solid.faces,
                link.surface_patch,
                length=link.geometry.length,
                modes=seen,
                path=path,
            )
            if link.surface_patch
            else None
        ),
        ffrobot_version=VERSION,
        remarks=solid.remarks,
    )


def _materials(link: SolidLink, solid: SolidMesh, path: Path) -> MaterialMap:
    """Materials of the cells, by region: of cells of several regions, that of the smallest."""
    for region in link.region:
        if region.group not in solid.regions:
            groups = ", ".join(sorted(solid.regions)) or "none"
            raise InputError(f"{path}: region.group: expected a volume group of the mesh ({groups})", region.group)
    largest_first = list(solid.regions)
    ordered = sorted(link.region, key=lambda region: largest_first.index(region.group))
    for k, region in enumerate(ordered):
        inside = [other.group for other in ordered[k + 1 :]]
        if set(solid.cells_of(region.group)) <= {tag for group in inside for tag in solid.cells_of(group)}:
            raise InputError(
                f"{path}: region.group of {region.group}: expected a volume group with own cells",
                f"all of them in {', '.join(inside)} too",
            )
    find = solid.cell_tags.find
    regions = [
        (np.concatenate([find(tag) for tag in solid.cells_of(region.group)]), region.material) for region in ordered
    ]
    return material_map(solid.mesh, link.material, regions)


def _places(link: SolidLink, model: SolidModel, solid: SolidMesh) -> Interfaces:
    """Root, tip and the interfaces of the link file: faces, or cross sections where the position is one number."""
    sections = {record.name: record.position for record in link.interface if isinstance(record.position, float)}
    faces = [name for name in ("root", "tip", *(record.name for record in link.interface)) if name not in sections]
    averages = {name: face_averages(model, solid.facet_tags, [solid.faces[name]]) for name in dict.fromkeys(faces)}
    averages |= {name: section_averages(model, np.array([x])) for name, x in sections.items()}
    return Interfaces(averages, {name: one.rows(model)[0] for name, one in averages.items()}, link.couplings)


def _supported(link: SolidLink, model: SolidModel, solid: SolidMesh, places: Interfaces, path: Path) -> Flexibility:
    """The body supported as its reference condition says, faces with rigid coupling made plates."""
    supports = SUPPORTS[link.reference.condition]
    plates = sorted(name for name, coupling in link.couplings.items() if coupling == "rigid")
    faces, taken = [], np.zeros(model.owned, dtype=bool)
    for name in plates:
        nodes = fem.locate_dofs_topological(model.V, 2, solid.facet_tags.find(solid.faces[name]))
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
        faces.append(RigidFace(name, own, places.averages[name].centroid[0], free))
    if link.coupling == "rigid":
        return Flexibility(model, faces, None)
    rows = [places.rows[name][list(components)] for name, components in supports.items()]
    return Flexibility(model, faces, np.concatenate(rows))


def _station_grid(link: SolidLink, solid: SolidMesh) -> tuple[Array, Integers]:
    """Stations x (3e + 1,) in m and the four of each cubic element (e, 4); vertices at the middle and at sections."""
    length = link.geometry.length
    elements = int(np.clip(np.ceil(length / solid.size), *ELEMENTS))
    sections = [record.position for record in link.interface if isinstance(record.position, float)]
    vertices = with_points(as_floats(np.linspace(0.0, length, elements + 1)), [0.5 * length, *sections])
    inner = vertices[:-1, None] + np.diff(vertices)[:, None] * np.array([0.0, 1.0, 2.0]) / 3
    element = 3 * np.arange(vertices.size - 1)[:, None] + np.arange(4)
    return np.append(inner.ravel(), length), element


def _stations(link: SolidLink, sections: Averages, x: Array, element: Integers, u: Array, turn: Array) -> Stations:
    """Extents and rigidity from each station on: those in the middle of the way to the next, by the stations' two."""
    centroid = sections.centroid.copy()
    centroid[:, 0] = x
    height, width, area = (_onward(values) for values in (sections.height, sections.width, sections.area))
    I_zz, I_yy = (_onward(sections.inertia[:, axis, axis]) for axis in (1, 2))
    modulus = np.ravel(link.material.youngs_modulus)[0]  # of an orthotropic one E_x
    rigidity = None if link.region else modulus * np.stack([area, I_yy], axis=1)
    lateral = None if link.region else modulus * I_zz
    middle, extents = _onward(sections.middle), np.stack([height, width], axis=1)
    is_off = np.any(np.abs(middle) > ROUND_OFF * extents)
    return Stations(
        centroid,
        u,
        turn,
        height,
        element,
        rigidity=rigidity,
        width=width,
        out_of_plane_rigidity=lateral,
        middle=middle if is_off else None,
    )


def _onward(values: Array) -> Array:
    """Of each station and the next, the mean; of the last its own."""
    return np.append(0.5 * (values[:-1] + values[1:]), values[-1:], axis=0)


def _picture(solid: SolidMesh, model: SolidModel, modes: Array) -> PictureMesh:
    """The surface with what `modes` (3 (owned + ghosts), n) do at its points; collective."""
    surface, n = solid.surface, modes.shape[1]
    shapes = lagrange_element(model.V).tabulate(0, surface.X)[0, :, :, 0]
    local = modes.reshape(-1, 3, n)[node_map(model.V)[surface.cells]]
    displacement = np.zeros((len(surface.points), 3, n))
    displacement[surface.rows] = np.einsum("pd,pdin->pin", shapes, local, optimize=True)
    return PictureMesh(surface.points, surface.triangles, model.total(displacement), surface.edges)
