"""XDMF files that show the grids of VTKHDF files to programs which cannot read those, such as ParaView before 5.12.

Format: xdmf.org, "XDMF model and format", version 2: an index as text; the numbers stay where they are.
"""

from __future__ import annotations

from xml.etree import ElementTree

import numpy as np

from .vtkhdf import ROOT, TOPOLOGY, Grid, mixed_topology


def xdmf_text(grid: Grid, hdf5: str) -> bytes:
    """The index of the grid in the file `hdf5`, which is in the same folder."""
    root = ElementTree.Element("Xdmf", Version="2.0")
    steps = ElementTree.SubElement(
        ElementTree.SubElement(root, "Domain"), "Grid", Name="bodies", GridType="Collection", CollectionType="Temporal"
    )
    time = np.zeros(1) if grid.time is None else grid.time
    cells, numbers_of_cells = sum(len(block) for block in grid.cells), len(mixed_topology(grid))
    for k, t in enumerate(time):
        step = ElementTree.SubElement(steps, "Grid", Name="bodies", GridType="Uniform")
        ElementTree.SubElement(step, "Time", Value=f"{t:.17g}")
        shape = ElementTree.SubElement(step, "Topology", TopologyType="Mixed", NumberOfElements=str(cells))
        _item(shape, (numbers_of_cells,), f"{hdf5}:/{TOPOLOGY}", "Int", 8)
        geometry = ElementTree.SubElement(step, "Geometry", GeometryType="XYZ")
        _slab(geometry, grid.points.shape, k, f"{hdf5}:/{ROOT}/Points")
        for name, values in grid.point_data.items():
            kind = "Vector" if values.ndim == 3 else "Scalar"
            attribute = ElementTree.SubElement(step, "Attribute", Name=name, AttributeType=kind, Center="Node")
            _slab(attribute, values.shape, k, f"{hdf5}:/{ROOT}/PointData/{name}")
        for name, numbers in grid.cell_data.items():
            attribute = ElementTree.SubElement(step, "Attribute", Name=name, AttributeType="Scalar", Center="Cell")
            _item(attribute, numbers.shape, f"{hdf5}:/{ROOT}/CellData/{name}", "Int", numbers.dtype.itemsize)
    ElementTree.indent(root)
    text: bytes = ElementTree.tostring(root, encoding="utf-8", xml_declaration=True)
    return text


def _slab(parent: ElementTree.Element, shape: tuple[int, ...], step: int, place: str) -> None:
    """The rows of one step, of a dataset (T P, …) with those of all steps."""
    (steps, count), rest = shape[:2], shape[2:]
    slab = ElementTree.SubElement(
        parent, "DataItem", ItemType="HyperSlab", Dimensions=_numbers((count, *rest)), NumberType="Float", Precision="4"
    )
    start, stride, size = (step * count, *(0 for _ in rest)), (1,) * (1 + len(rest)), (count, *rest)
    choice = ElementTree.SubElement(slab, "DataItem", Dimensions=f"3 {len(size)}", Format="XML", NumberType="Int")
    choice.text = " ".join(_numbers(row) for row in (start, stride, size))
    _item(slab, (steps * count, *rest), place, "Float", 4)


def _item(parent: ElementTree.Element, shape: tuple[int, ...], place: str, kind: str, precision: int) -> None:
    item = ElementTree.SubElement(
        parent, "DataItem", Dimensions=_numbers(shape), Format="HDF", NumberType=kind, Precision=str(precision)
    )
    item.text = place


def _numbers(row: tuple[int, ...]) -> str:
    return " ".join(map(str, row))
