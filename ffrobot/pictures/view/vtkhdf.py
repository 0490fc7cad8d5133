"""VTKHDF files: VTK's unstructured grids in HDF5, written without VTK.

Format: docs.vtk.org, "VTKHDF format specification", version 2.0; ParaView reads it from 5.12 on. Cells are there once,
points and their data once for each time step.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field

import h5py
import numpy as np

from ...common.arrays import Array, Indices, Integers, NDArray
from ...common.errors import InputError
from ...common.hdf5 import image_of, in_memory
from ...fe_models.modal_body import ModalBody
from ...mbs.quantities.stress import surface_stress, von_mises
from ...results.file import Results
from ..motion import moving_bodies
from ..shapes import body_surface, surface_shape

# VTK's number of the cell with so many corners: vertex, line, triangle, quadrilateral.
CELL_TYPE = {1: 1, 2: 3, 3: 5, 4: 9}
ROOT = "VTKHDF"


@dataclass(frozen=True)
class Grid:
    """Cells on P points that move over T steps.

    Attributes:
        cells: blocks (c, v) of cells with v corners each, in order.
        points: (T, P, 3) in m.
        time: (T,) in s; None for a grid that stands still, T = 1.
        point_data: (T, P) or (T, P, 3) by name.
        cell_data: (C,) by name, for all cells of all blocks.
    """

    cells: Sequence[Integers]
    points: Array
    time: Array | None = None
    point_data: Mapping[str, Array] = field(default_factory=dict)
    cell_data: Mapping[str, NDArray[np.generic]] = field(default_factory=dict)


def vtkhdf_image(grid: Grid) -> bytes:
    """The file as bytes; the same grid always gives the same. Numbers of points have 7 digits."""
    with in_memory() as file:
        root = file.create_group(ROOT)
        root.attrs["Version"] = np.array([2, 0])
        root.attrs["Type"] = np.bytes_("UnstructuredGrid")
        _write_cells(root, grid)
        _write(root, "Points", _flat(grid.points))
        for name, values in grid.point_data.items():
            _write(root, f"PointData/{name}", _flat(values))
        for name, cell_values in grid.cell_data.items():
            _write(root, f"CellData/{name}", cell_values)
        if grid.time is not None:
            _write_steps(root, grid, grid.time)
        return image_of(file)


def _write_cells(root: h5py.Group, grid: Grid) -> None:
    corners = np.concatenate([np.full(len(block), block.shape[1]) for block in grid.cells])
    connectivity = np.concatenate([block.ravel() for block in grid.cells])
    counts = {"Points": grid.points.shape[1], "Cells": len(corners), "ConnectivityIds": len(connectivity)}
    for name, count in counts.items():
        _write(root, f"NumberOf{name}", np.array([count]))
    _write(root, "Connectivity", connectivity)
    _write(root, "Offsets", np.concatenate([[0], np.cumsum(corners)]))
    _write(root, "Types", np.array([CELL_TYPE[v] for v in corners], dtype=np.uint8))


def _write_steps(root: h5py.Group, grid: Grid, time: Array) -> None:
    """Where each step begins: its points and their data follow those of the step before, cells are the same."""
    steps = root.create_group("Steps")
    steps.attrs["NSteps"] = len(time)
    same, own = np.zeros(len(time), dtype=np.int64), np.arange(len(time)) * grid.points.shape[1]
    _write(steps, "Values", time)
    _write(steps, "NumberOfParts", np.ones_like(same))
    _write(steps, "PartOffsets", same)
    _write(steps, "PointOffsets", own)
    _write(steps, "CellOffsets", same[:, None])
    _write(steps, "ConnectivityIdOffsets", same[:, None])
    for name in grid.point_data:
        _write(steps, f"PointDataOffsets/{name}", own)
    for name in grid.cell_data:
        _write(steps, f"CellDataOffsets/{name}", same)


def _flat(values: Array) -> NDArray[np.float32]:
    """(T P, …) of (T, P, …), in the precision of the file."""
    return values.reshape(-1, *values.shape[2:]).astype(np.float32)


def _write(group: h5py.Group, name: str, values: NDArray[np.generic]) -> None:
    packed = {"compression": "gzip", "compression_opts": 1, "shuffle": True} if values.size > 1000 else {}
    group.create_dataset(name, data=values, track_times=False, **packed)


def modes_grid(body: ModalBody) -> Grid:
    """The surface of a link, undeformed, with every mode as a vector: displacement per unit of modal coordinate."""
    mesh = body_surface(body)
    names = [f"mode {k + 1:02d}, {body.frequency[k]:.5g} Hz, {family}" for k, family in enumerate(body.family)]
    modes = {name: mesh.mode_shapes[None, :, :, k] for k, name in enumerate(names)}
    return Grid([mesh.cells], mesh.points[None], point_data=modes)


def results_grid(results: Results, analysis: str, frames: Indices, notes: list[str]) -> Grid:
    """The bodies of an analysis at the outputs `frames` (T,), where they were: r = R + A (x + Φ p), m, global axes.

    Point data: `deflection` A Φ p, and `exaggeration`, by which points move when deflections are made larger by one
    while joints stay shut: r + (s − 1) exaggeration shows deformations s times as large. `von_mises`, Pa, where
    stresses of a surface are known. Cell data: `body`, its number in the scene. `notes` say what could not be drawn as
    it is.
    """
    bodies = moving_bodies(results, analysis, frames)
    shapes = [surface_shape(results, body, notes) for body in bodies]
    deflections = [shape.deflection for shape in shapes]
    exaggerations = [part + body.shift[:, None] for part, body in zip(deflections, bodies, strict=True)]
    data = {"deflection": deflections, "exaggeration": exaggerations}
    stresses = [_von_mises(results, analysis, body.name, frames) for body in bodies]
    if any(stress is not None for stress in stresses):
        data["von_mises"] = [
            np.full(deflection.shape[:2], np.nan) if stress is None else stress
            for stress, deflection in zip(stresses, deflections, strict=True)
        ]
    first = np.cumsum([0, *(len(shape.points) for shape in shapes[:-1])])
    numbers = [body["name"] for body in results.scene["body"]]
    return Grid(
        cells=[shape.cells + start for shape, start in zip(shapes, first, strict=True)],
        points=np.concatenate([shape.placed() for shape in shapes], axis=1),
        time=results.time(analysis)[frames],
        point_data={name: np.concatenate(parts, axis=1) for name, parts in data.items()},
        cell_data={"body": np.repeat([numbers.index(b.name) for b in bodies], [len(s.cells) for s in shapes])},
    )


def _von_mises(results: Results, analysis: str, body: str, frames: Indices) -> Array | None:
    """(T, p) Pa on the surface of a body; None where it is not known."""
    if not results.has(f"{analysis}/stress/{body}/surface"):
        return None
    try:
        link = results.modal_body(body)
    except InputError:  # a note where its surface is drawn
        return None
    return von_mises(surface_stress(link, results.stress_recovery(analysis, body).at(frames)))
