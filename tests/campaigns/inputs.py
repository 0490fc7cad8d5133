"""Meshes, motions, tables and controllers, one change each: refused, or taken.

    python tests/campaigns/inputs.py [--count 100] [--seed 0] [--kind KIND …] [--record]

Kinds are skin, mesh, motion, bag, csv, catalog and controller.

Run by hand, some 0.3 s each. Cells get values of other types, huge, tiny, not finite, empty, names that lead elsewhere,
and text that programs would run: a file CANARY must not appear, nor anything beside the folder. Commands run as in
mutations.py. Exit code 1 where anything fell over.
"""

import os
import random
import shutil
import sys
import tempfile
from pathlib import Path

sys.path.append(str(Path(__file__).parents[1] / "mesh"))
import gmsh
import meshio
import trimesh
from decks import bar, elements, fixed, free, nodes, tetrahedra
from forked_command import Outcomes, outcome, run
from hostile import Damage
from record import options, record

from ffrobot.mesh.gmsh_session import gmsh_session

NUMBERS = tuple(
    "0 -1 1e-320 1e300 -1e29 18446744073709551616 999999999999999999999 nan inf 1,5 0x10 1_0 180 1e9".split(" ")  # noqa: SIM905
)
RUN = ("=cmd|' /C calc'!A0", '__import__("os").system("touch CANARY")', "$(touch CANARY)", "`touch CANARY`", "{{7*7}}")
ODD = (
    "", " ", "/", "..", "../../out", "/tmp/ffrobot_out", "a\nb", "a" * 300, "é関", "\u202e", "\0", "<script>", "%s%n",
)  # fmt: skip
TEXTS = (*NUMBERS, *RUN, *ODD)
LINK = """
name = "arm"
material = { youngs_modulus = 70e9, poissons_ratio = 0.33, density = 2700.0 }
geometry = { kind = "beam", length = 0.6, section = { shape = "tube", outer = 0.02, inner = 0.016 } }
mesh = { elements = 10 }
reference = { condition = "cantilever" }
modes = { count = 3, family = "in-plane-bending" }
"""
PART = """
name = "part"
material = {{ youngs_modulus = 70e9, poissons_ratio = 0.33, density = 2700.0 }}
geometry = {{ kind = "solid", length = 1.0, file = "{}" }}
reference = {{ condition = "cantilever" }}
modes = {{ count = 1, attachment_modes = false }}
"""
SCENE = """
name = "arm"
gravity = [0.0, -9.81]
body = [{ name = "arm", link = "arm.toml" }]
joint = [{ name = "shoulder", type = "revolute", between = ["ground", "arm.root"] }]
trajectory = [{ name = "swing", joint = "shoulder", waypoints = "path.csv" }]
payload = [{ point = "arm.tip", mass = 0.5 }]
analysis = [{ name = "inverse", kind = "pcid", end = 0.05, output_step = 0.005, tolerance = 1e-4, max_steps = 20000 }]
"""
ROBOT = """<robot name="r"><link name="base"/><link name="arm">
<inertial><mass value="1"/><inertia ixx="1" iyy="1" izz="1" ixy="0" ixz="0" iyz="0"/></inertial>
<visual><geometry><mesh filename="{}"/></geometry></visual></link>
<joint name="j" type="revolute"><parent link="base"/><child link="arm"/><axis xyz="0 0 1"/>
<limit lower="-1" upper="1" effort="1" velocity="1"/></joint></robot>"""
CATALOG = """name, rated_torque, peak_torque, max_speed, rotor_inertia, gear_ratio, efficiency, mass
M30, 0.10, 0.30, 630, 0.3e-5, 50 80 100, 0.8, 0.5
M60, 2.0, 6.0, 630, 1e-5, , , 0.8
"""
CONTROLLER = """

def law(setup):
    def at(k, y):
        return [0.0]

    return at
"""
LOOP = (
    ', { name = "loop", kind = "closed-loop", actuation = "inverse", tip = "arm.tip", end = 0.05, output_step = 0.005,'
    ' sample_time = 0.005, controller = [{ kind = "python", python = "law.py:law" }] }]'
)
RETURNED = (
    "nan", "float('nan')", "float('inf')", "1e300", "None", "'a'", "1j", "[[1.0]]", "True", "1 / 0", "y['x']", "y",
    "exit()", "quit(3)", "setup", "[0.0] * 3", "(_ for _ in ())", "-1e9", "10**400", "open('nowhere')",
    "__import__('nowhere')", "at(k, y)", "__import__('os').abort", "setup.columns('x')",
    "setup.places('joint/x/moment')", "y.clear()", "y.fill(np.nan)", "np.zeros(0)", "__import__('sys').exit('bye')",
    "np.ones(10**6)", "[y] * 2", "print('hello')", "input()", "raise_()", "(yield)", "lambda: 0",
)  # fmt: skip
SKINS = ("3mf", "dae", "glb", "obj", "off", "ply", "stl")
TABLE = "t,value\n0,0\n0.02,0.1\n0.04,0.15\n0.06,0.2\n"


class Campaign:
    def __init__(self, folder: Path, seed: int) -> None:
        self.draw, self.found = random.Random(seed), Outcomes()
        self.place, self.ready = folder / "place" / "try", folder / "ready"
        os.environ["XDG_CACHE_HOME"] = str(folder / "cache")
        self.ready.mkdir()
        for name, text in (("scene.toml", SCENE), ("arm.toml", LINK), ("path.csv", TABLE)):
            (self.ready / name).write_text(text, encoding="utf-8")
        for command in (["link", "arm.toml"], ["solve", "scene.toml"]):
            code, told = run(command, self.ready)
            assert code == 0, told
        box = trimesh.creation.box((0.1, 0.2, 0.3))
        for ending in SKINS:
            box.export(self.ready / f"skin.{ending}")
        for form, name in (("joint-trajectory", "motion.json"), ("rosbag2", "bag")):
            code, told = run(["export", "scene.results.h5", "--format", form, "-o", name], self.ready)
            assert code == 0, told
        self.parts()
        self.damage = Damage(self.draw, b'import os; os.system("touch CANARY")\nSystemCall "touch CANARY";\n')

    def parts(self) -> None:
        """A bar as meshes in all formats, and in STEP."""
        points, cells = bar()
        tets = tetrahedra(cells)
        (self.ready / "mesh.inp").write_text(nodes(points) + elements(tets, "C3D4"))
        (self.ready / "mesh.bdf").write_text(free(points, cells))
        (self.ready / "mesh.nas").write_text(fixed(points, tets, "CTETRA", wide=True))
        for ending, keys in (("vtk", {}), ("vtu", {}), ("med", {}), ("msh", {}), ("xdmf", {"data_format": "XML"})):
            meshio.Mesh(points, [("tetra", tets)]).write(self.ready / f"mesh.{ending}", **keys)
        with gmsh_session():
            gmsh.model.occ.addBox(0, -0.1, -0.05, 1, 0.2, 0.1)
            gmsh.model.occ.synchronize()
            gmsh.write(str(self.ready / "mesh.step"))

    def one(self, kind: str, number: int) -> None:
        shutil.rmtree(self.place.parent, ignore_errors=True)
        shutil.copytree(self.ready, self.place)
        label, name, commands = getattr(self, kind)()
        for command in commands:
            code, told = run(command, self.place)
            kind_of_end = outcome(code, told, [name, "scene.toml"])
            canary = kind != "controller" and (self.place / "CANARY").exists()
            if canary or os.listdir(self.place.parent) != ["try"]:
                kind_of_end = "crash"
            self.found.add(kind, kind_of_end, f"{number} {command[0]} {label}", code, told)

    def skin(self):
        """A mesh that a robot shows, and whose filled volume can be its mass."""
        name = f"skin.{self.draw.choice(SKINS)}"
        label = self.of_bytes(self.place / name)
        robot, filled = ROBOT.format(name), self.draw.random() < 0.5
        if filled:
            robot = robot.replace(robot[robot.index("<inertial>") : robot.index("<visual>")], "")
        (self.place / "robot.urdf").write_text(robot)
        commands = [["import", "robot.urdf", "-o", "out", *(["--density", "1000"] if filled else [])]]
        return f"{name} {label}", "robot.urdf", commands

    def mesh(self):
        """Of a part, beside options for gmsh."""
        path = self.draw.choice(sorted(self.place.glob("mesh.*")))
        label = self.of_bytes(path)
        path.with_name(f"{path.name}.opt").write_bytes(self.damage.script)
        (self.place / "part.toml").write_text(PART.format(path.name), encoding="utf-8")
        return f"{path.name} {label}", path.name, [["link", "part.toml"]]

    def motion(self):
        return self.of_bytes(self.place / "motion.json"), "motion.json", [["import", "motion.json", "-o", "m.csv"]]

    def bag(self):
        path = self.draw.choice(sorted((self.place / "bag").iterdir()))
        return f"{path.name} {self.of_bytes(path)}", "bag", [["import", "bag", "-o", "m.csv"]]

    def of_bytes(self, path: Path) -> str:
        content, how = self.damage.of(path.read_bytes())
        path.write_bytes(content)
        return how

    def csv(self):
        lines = TABLE.splitlines()
        row = self.draw.randrange(len(lines))
        cells = lines[row].split(",")
        how = self.draw.choice(("cell", "cell", "cell", "row", "twice", "column"))
        if how == "cell":
            cells[self.draw.randrange(2)] = self.draw.choice(TEXTS)
        lines[row] = {"row": self.draw.choice(TEXTS), "column": lines[row] + ",1"}.get(how, ",".join(cells))
        lines += [lines[row]] if how == "twice" else []
        encoding = self.draw.choice(("utf-8", "utf-8", "utf-16", "utf-8-sig"))
        (self.place / "path.csv").write_bytes(self.draw.choice(("\n", "\r\n")).join(lines).encode(encoding))
        return f"{how} {lines[row]!r} {encoding}", "path.csv", [["solve", "scene.toml"]]

    def catalog(self):
        (self.place / "motors.csv").write_text(CATALOG, encoding="utf-8")
        how = self.of_bytes(self.place / "motors.csv")
        return how, "motors.csv", [["feasibility", "scene.results.h5", "--catalog", "motors.csv"]]

    def controller(self):
        """A line of Python that is damaged, or that returns, raises or waits for something else."""
        text = CONTROLLER
        if self.draw.random() < 0.7:
            text = text.replace("[0.0]", self.draw.choice(RETURNED), 1)
            how = text.splitlines()[5]
        (self.place / "law.py").write_text(text, encoding="utf-8")
        if text == CONTROLLER:
            how = self.of_bytes(self.place / "law.py")
        (self.place / "scene.toml").write_text(SCENE.strip().removesuffix("]") + LOOP, encoding="utf-8")
        return how, "law.py", [["solve", "scene.toml"]]


KINDS = ("skin", "mesh", "motion", "bag", "csv", "catalog", "controller")


def main() -> None:
    """Prints what was found."""
    parser = options(__doc__, count=100, seed=0)
    parser.add_argument("--kind", action="append", choices=KINDS, help="only this one; repeatable")
    asked = parser.parse_args()
    kinds = asked.kind or KINDS
    with tempfile.TemporaryDirectory() as folder:
        campaign = Campaign(Path(folder), asked.seed)
        for number in range(asked.count):
            campaign.one(kinds[number % len(kinds)], number)
    campaign.found.show()
    if asked.record:
        found = ", ".join(f"{name} {count}" for name, count in sorted(campaign.found.counts.items()))
        record("inputs", tried=f"{asked.count} changed files", found=found)
    sys.exit(bool(campaign.found.bad))


if __name__ == "__main__":
    main()
