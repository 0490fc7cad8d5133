"""Files of parts, damaged at random: read as the same part, refused with one message, or told to be another one.

    python tests/campaigns/meshes.py [--count 100] [--seed 0] [--kind KIND …] [--record]

A bar in all formats (Abaqus with tied instances, Nastran in three forms, gmsh 2.2 and 4.1 in text and binary, VTK, VTU,
MED, XDMF, STEP) is changed in one place and read in a forked process. Exit code 1 where anything fell over: a traceback
or crash, no end within four minutes of processor time, words on stderr, a script that has run. What changes the volume
without a remark is listed to be judged: another number, or a line less, may describe another part in its own right.
"""

import json
import os
import random
import resource
import sys
import tempfile
import traceback
from collections import Counter
from pathlib import Path

sys.path.append(str(Path(__file__).parents[1] / "mesh"))
import meshio
import numpy as np
from decks import HEIGHT, VOLUME, bar, elements, fixed, free, nodes, tetrahedra
from hostile import Damage
from record import options, record

from ffrobot.common.errors import InputError
from ffrobot.mesh.part import part_mesh
from ffrobot.mesh.records import PartTables, SolidGeometry

SECONDS = 240
TOLD = ("same part", "rejected", "told to differ", "differs")
BAD = ("traceback", "crash", "hang", "noise", "code ran")


def written(folder: Path) -> list[Path]:
    """The bar in all formats."""
    points, cells = bar()
    tets = tetrahedra(cells)
    half, half_cells = bar(ny=1, y=(-HEIGHT / 2, 0.0))
    part = "*Part, name=HALF\n" + nodes(half) + elements(half_cells) + "*Elset, elset=ALL, generate\n1, 3\n*End Part\n"
    instances = "*Assembly, name=A\n*Instance, name=H-1, part=HALF\n*End Instance\n*Instance, name=H-2, part=HALF\n"
    instances += "0., 0.1, 0.\n0., 0.05, 0., 1., 0.05, 0., 0.\n*End Instance\n*Surface, name=UP\nH-1.ALL, S5\n"
    instances += "*Surface, name=DOWN\nH-2.ALL, S3\n*Tie, name=glue\nDOWN, UP\n*End Assembly\n"
    system = "CORD2R,7,0,0.,0.,0.,0.,0.,1.\n,1.,0.,0.\nCORD1R,9,501,502,503\n"
    system += "GRID,501,7,0.,0.,0.\nGRID,502,7,0.,0.,1.\nGRID,503,7,1.,0.,0.\n"
    texts = {
        "plain.inp": nodes(points) + elements(tets, "C3D4") + "*NSET, NSET=LEFT, GENERATE\n1, 6\n",
        "instances.inp": part + instances,
        "free.bdf": "SOL 103\nCEND\nBEGIN BULK\n" + free(points, cells, cp="9") + system + "ENDDATA\n",
        "fixed.nas": fixed(points, cells, mark="+"),
        "wide.bdf": fixed(points, tets, "CTETRA", wide=True),
    }
    for name, text in texts.items():
        (folder / name).write_text(text)
    for name, kind, of, keys in (
        ("bar.vtk", "tetra", tets, {}), ("bar.vtu", "hexahedron", cells, {}), ("bar.med", "tetra", tets, {}),
        ("bar.xdmf", "tetra", tets, {"data_format": "XML"}), ("text.vtk", "tetra", tets, {"binary": False}),
        ("old.msh", "tetra", tets, {"file_format": "gmsh22", "binary": False}),
        ("old_binary.msh", "tetra", tets, {"file_format": "gmsh22"}),
    ):  # fmt: skip
        mesh = meshio.Mesh(
            points, [(kind, of)], cell_data={} if "med" in name else {"of": [np.zeros(len(of), dtype=int)]}
        )
        mesh.write(folder / name, **keys)
    _by_gmsh(folder)
    return sorted(folder.iterdir())


def _by_gmsh(folder: Path) -> None:
    import gmsh

    from ffrobot.mesh.gmsh_session import gmsh_session

    with gmsh_session():
        box = gmsh.model.occ.addBox(0, -0.1, -0.05, 1, 0.2, 0.1)
        hole = gmsh.model.occ.addCylinder(0.5, 0, -0.05, 0, 0, 0.1, 0.03)
        gmsh.model.occ.cut([(3, box)], [(3, hole)])
        gmsh.model.occ.synchronize()
        gmsh.write(str(folder / "holed.step"))
    with gmsh_session():
        for x in (0, 0.5):
            gmsh.model.occ.addBox(x, -0.1, -0.05, 0.5, 0.2, 0.1)
        gmsh.model.occ.synchronize()
        gmsh.write(str(folder / "halves.step"))
    with gmsh_session():
        gmsh.model.occ.addBox(0, -0.1, -0.05, 1, 0.2, 0.1)
        gmsh.model.occ.synchronize()
        gmsh.write(str(folder / "box.step"))
        gmsh.model.setPhysicalName(3, gmsh.model.addPhysicalGroup(3, [1]), "bar")
        gmsh.option.setNumber("Mesh.MeshSizeMax", 0.1)
        gmsh.model.mesh.generate(3)
        for name, binary in (("new.msh", 0), ("new_binary.msh", 1)):
            gmsh.option.setNumber("Mesh.Binary", binary)
            gmsh.write(str(folder / name))


def read(path: Path) -> tuple[str, str]:
    """What becomes of a part in a forked process, and what it says."""
    out, told = path.with_name("answer.json"), path.with_name("stderr.txt")
    out.unlink(missing_ok=True)
    child = os.fork()
    if child == 0:
        resource.setrlimit(resource.RLIMIT_CPU, (SECONDS, SECONDS))
        resource.setrlimit(resource.RLIMIT_CORE, (0, 0))
        resource.setrlimit(resource.RLIMIT_AS, (8 << 30, 8 << 30))
        os.dup2(os.open(told, os.O_WRONLY | os.O_CREAT | os.O_TRUNC), 2)
        out.write_text(json.dumps(_answer(path)))
        os._exit(0)
    _, status, _ = os.wait4(child, 0)
    if os.WIFSIGNALED(status):
        return ("hang" if os.WTERMSIG(status) in (9, 24) else "crash"), f"signal {os.WTERMSIG(status)}"
    if words := told.read_text(errors="replace").strip():
        return "noise", words[-300:]
    kind, said = json.loads(out.read_text())
    return kind, said


def _answer(path: Path) -> tuple[str, str]:
    geometry = SolidGeometry.model_validate({"kind": "solid", "length": 1.0, "file": path}, strict=False)
    if path.suffix == ".step":
        geometry = geometry.model_copy(update={"unit": "m"})
    try:
        part = part_mesh(PartTables(Path("link.toml"), geometry), lambda _: None)
    except InputError as error:
        return (
            "hang"
            if "found no end" in str(error) and "STEP" not in str(error) and path.suffix != ".step"
            else "rejected"
        ), str(error)
    except BaseException:
        return "traceback", traceback.format_exc()[-600:]
    from solid_parts import integrate

    volume = integrate(part)
    right = VOLUME if path.name != "holed.step" else VOLUME - 0.1 * np.pi * 0.03**2
    if abs(volume / right - 1) < 1e-4:
        return "same part", ""
    return ("told to differ" if part.remarks else "differs"), f"volume {volume:.6g}, {'; '.join(part.remarks)}"


def main() -> None:
    """Prints what was found."""
    parser = options(__doc__, count=100, seed=0)
    parser.add_argument("--kind", action="append", help="only files of this name or ending; repeatable")
    asked = parser.parse_args()
    counts: Counter[str] = Counter()
    with tempfile.TemporaryDirectory() as temporary:
        sound, tried = Path(temporary) / "sound", Path(temporary) / "tried"
        sound.mkdir()
        tried.mkdir()
        ran = Path(temporary) / "ran"
        script = f'SystemCall "touch {ran}";\nPrintf("x") > "{ran}";\n'.encode()
        files = [f for f in written(sound) if not asked.kind or any(f.name.endswith(kind) for kind in asked.kind)]
        for file in files:
            kind, said = read(file)
            assert kind == "same part", (file, kind, said)
        damage = Damage(random.Random(asked.seed), script)
        for number in range(asked.count):
            file = files[number % len(files)]
            content, how = damage.of(file.read_bytes())
            path = tried / file.name
            path.write_bytes(content)
            path.with_name(file.name + ".opt").write_bytes(script)
            kind, said = read(path)
            kind = "code ran" if ran.exists() else kind
            ran.unlink(missing_ok=True)
            counts[kind] += 1
            if kind in (*BAD, "differs", "told to differ"):
                print(f"{kind}: {number} {file.name}: {how}: {said}", flush=True)
    print(", ".join(f"{counts[kind]} × {kind}" for kind in (*TOLD, *BAD)))
    if asked.record:
        told = f"{asked.count} single changes of a bar in {len(files)} files of meshes and STEP"
        record("meshes", tried=told, found=", ".join(f"{counts[kind]} × {kind}" for kind in (*TOLD, *BAD)))
    sys.exit(any(counts[kind] for kind in BAD))


if __name__ == "__main__":
    main()
