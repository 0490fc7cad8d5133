"""What imports and exports print."""

from __future__ import annotations

from pathlib import Path

from rich.console import Console

from ..present.lines import plain_table
from .export import Exported
from .urdf.import_urdf import Imported

UNITS = {"revolute": "rad", "prismatic": "m"}


def print_import(imported: Imported, console: Console) -> None:
    """A line on the whole, tables of joints and of what meshes say, remarks, files."""
    robot, scene = imported.robot, imported.scene
    moving = [joint for joint in scene["joint"] if joint["type"] != "weld"]
    mass = sum(body["rigid"]["mass"] for body in scene["body"] if "rigid" in body)
    console.print(
        f"{robot.name}: {len(robot.links)} links and {len(robot.joints)} joints, of which {len(scene['body'])} bodies"
        f" and {len(moving)} joints move; {mass:.6g} kg in rigid bodies",
        highlight=False, soft_wrap=True,
    )  # fmt: skip
    table = plain_table("joint", "type", "range", "moment or force", "speed", "damping", "friction")
    for joint in moving:
        low_high = joint.get("position_limit")
        table.add_row(
            joint["name"],
            joint["type"],
            f"{low_high[0]:.4g} … {low_high[1]:.4g} {UNITS[joint['type']]}" if low_high else "–",
            *(f"{joint[key]:.4g}" if key in joint else "–"
              for key in ("moment_limit", "speed_limit", "viscous_friction", "coulomb_friction")),
        )  # fmt: skip
    console.print(table)
    if imported.masses:
        _print_masses(imported, console)
    for remark in imported.remarks:
        console.print(f"note       {remark}", highlight=False, soft_wrap=True, markup=False)
    _print_files(imported.files, console)


def print_export(exported: Exported, console: Console) -> None:
    """What was written, and what the format does not carry."""
    for remark in exported.remarks:
        console.print(f"note       {remark}", highlight=False, soft_wrap=True, markup=False)
    console.print(f"written    {exported.path}: {exported.what}", highlight=False, soft_wrap=True, markup=False)


def _print_masses(imported: Imported, console: Console) -> None:
    table = plain_table(
        "link", "mesh", "mass kg", "volume m³", "implied kg/m³", "inertia: mesh / URDF", "centers apart m"
    )
    for each in imported.masses:
        inertial = imported.robot.links[each.link].inertial
        mass = inertial.mass if inertial is not None else 0.0
        table.add_row(
            each.link, "closed" if each.is_closed else "open", f"{mass:.4g}", f"{each.volume:.3g}",
            f"{each.density:.4g}", f"{each.inertia_ratio:.3g}", f"{each.center_distance:.2g}",
        )  # fmt: skip
    console.print()
    console.print(table)
    console.print(
        "note       meshes are skins: a filled one has the stiffness of no real casting; links are rigid unless"
        " --flexible names a file",
        highlight=False, soft_wrap=True,
    )  # fmt: skip


def _print_files(files: tuple[Path, ...], console: Console) -> None:
    for path in files:
        console.print(f"written    {path}", highlight=False, soft_wrap=True, markup=False)
