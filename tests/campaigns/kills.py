"""Signals at random times to all commands: what is left half-written, fails the next time, or is lost.

    python tests/campaigns/kills.py [--tries 100] [--seed 0] [--record]

Run by hand, some minutes. Each try starts a command in a folder of its own, sends SIGINT, SIGTERM or SIGKILL after a
random part of the time that it takes, looks at every file, and runs the same command again, with the same cache. Exit
code 1 where anything was found.
"""

import os
import random
import re
import shutil
import signal
import sys
import tempfile
import time
import zipfile
from collections import Counter
from pathlib import Path
from subprocess import DEVNULL, PIPE, Popen

import numpy as np
from record import options, record

from ffrobot.fe_models.modal_body_file import is_modal_body_file, read_modal_body
from ffrobot.results.file import Results

PROGRAM = Path(sys.executable).with_name("ffrobot")
SIGNALS = (signal.SIGINT, signal.SIGTERM, signal.SIGKILL)
LINK = """
name = "arm"
material = { youngs_modulus = 70e9, poissons_ratio = 0.33, density = 2700.0 }
geometry = { kind = "beam", length = 0.6, section = { shape = "tube", outer = 0.02, inner = 0.016 } }
mesh = { elements = 10 }
reference = { condition = "cantilever" }
modes = { count = 3, family = "in-plane-bending" }
"""
SCENE = """
name = "one"
gravity = [0.0, -9.81]
body = [{ name = "arm", link = "arm.toml" }]
joint = [{ name = "shoulder", type = "revolute", between = ["ground", "arm.root"] }]
payload = [{ point = "arm.tip", mass = 0.1 }]
trajectory = [{ name = "swing", joint = "shoulder", value = "0.1 + 0.08*(1 - cos(10*pi*t))" }]
pzt = [{ body = "arm", count = 4, length = 0.06, width = 0.02, thickness = 0.5e-3, modulus = 63e9, d31 = 110e-12 }]
analysis = [
    { name = "inverse", kind = "pcid", end = 0.5, output_step = 2e-5 },
    { name = "again", kind = "pcid", end = 0.5, output_step = 2e-5 },
    { name = "linear", kind = "linear", about = "inverse", times = [0.05] },
]
"""
SPACE = SCENE.replace("gravity = [0.0, -9.81]", 'space = "spatial"\ngravity = [0.0, 0.0, -9.81]')
SPACE = SPACE.replace('"arm.root"] }', '"arm.root"], axis = [0, 1, 0] }')
ROBOT = """<robot name="two">
<link name="base"/>
<link name="arm"><inertial><origin xyz="0.2 0 0"/><mass value="1"/>
<inertia ixx="0.01" iyy="0.02" izz="0.02" ixy="0" ixz="0" iyz="0"/></inertial></link>
<joint name="j" type="revolute"><parent link="base"/><child link="arm"/><axis xyz="0 0 1"/>
<limit lower="-1" upper="1" effort="10" velocity="2"/></joint>
</robot>
"""
GIVEN = {"arm.toml": LINK, "scene.toml": SCENE, "space.toml": SPACE, "robot.urdf": ROBOT}
SWEEP = ["--vary", "payload.0.mass=0.1,0.2", "-j", "2"]
COMMANDS = {
    "link": ["link", "arm.toml"],
    "solve": ["solve", "scene.toml", "--log-file", "log"],
    "solve in space": ["solve", "space.toml", "--log-file", "log"],
    "sweep": ["sweep", "scene.toml", *SWEEP],
    "info": ["info", "scene.results.h5"],
    "feasibility": ["feasibility", "scene.results.h5"],
    "linear": ["linear", "scene.results.h5"],
    "report": ["report", "scene.results.h5"],
    "plot": ["plot", "scene.results.h5", "--format", "png"],
    "view": ["view", "scene.results.h5", "--frames", "20", "--no-pictures"],
    "schema": ["schema", "scene"],
    "import": ["import", "robot.urdf", "-o", "robot", "--force"],
    "export csv": ["export", "scene.results.h5", "--format", "csv"],
    "export sid": ["export", "arm.h5", "--format", "sid"],
    "export fmu": ["export", "scene.results.h5", "--analysis", "linear", "--format", "fmu"],
}
OFTEN = {"link": 4, "solve": 4, "solve in space": 4, "sweep": 2}
BEGIN = ("link", "solve", "solve in space", "sweep")  # with nothing but what the user wrote
OURS = re.compile(rf'File "{Path(__file__).parents[2]}/(ffrobot|common|mesh|fe_models|mbs|actuation)/')
BEFORE_US = "traceback while Python itself starts"  # nobody can change that
KINDS = ("half-written file", "next run fails", "lost analysis", "traceback", BEFORE_US, "slow to stop")
PATIENCE = 300.0  # s for any command


class Campaign:
    """Its `found` are the failures, by kind."""

    def __init__(self, folder: Path, seed: int) -> None:
        self.folder, self.chance = folder, random.Random(seed)
        self.found: Counter[str] = Counter()
        self.codes: Counter[str] = Counter()
        self.ready = folder / "ready"
        self.cache = folder / "cache"
        self.prepare(self.ready)
        self.seconds = {name: self.time(name) for name in COMMANDS}

    def prepare(self, place: Path) -> None:
        place.mkdir()
        for name, text in GIVEN.items():
            (place / name).write_text(text, encoding="utf-8")

    def start(self, name: str, place: Path, cache: Path) -> Popen[str]:
        environment = os.environ | {"XDG_CACHE_HOME": str(cache), "OMP_NUM_THREADS": "1"}
        command = [PROGRAM, *COMMANDS[name]]
        return Popen(command, cwd=place, env=environment, stdout=DEVNULL, stderr=PIPE, text=True)

    def time(self, name: str) -> float:
        began = time.monotonic()
        process = self.start(name, self.ready, self.cache)
        _, told = process.communicate(timeout=PATIENCE)
        assert process.returncode == 0, f"{name}: {told}"
        return time.monotonic() - began

    def one(self, number: int) -> None:
        name = self.chance.choice([n for n in COMMANDS for _ in range(OFTEN.get(n, 1))])
        kind = self.chance.choice(SIGNALS)
        part = self.chance.random()
        place, cache = self.folder / f"{number}", self.folder / f"cache{number}"
        self.prepare(place)
        fresh = name in BEGIN[:3] and self.chance.random() < 0.5  # forms and links not in the cache
        if not fresh:
            shutil.copytree(self.cache, cache)
        for file in ("scene.results.h5", "arm.h5") if name not in BEGIN else ():
            shutil.copy(self.ready / file, place)
        label = f"{number}: {name}, {kind.name} after {part:.2f}, {'empty' if fresh else 'filled'} cache"
        process = self.start(name, place, cache)
        time.sleep(part * self.seconds[name] * (3.0 if fresh else 1.0))
        process.send_signal(kind)
        sent = time.monotonic()
        _, told = process.communicate(timeout=PATIENCE)
        took = time.monotonic() - sent
        self.codes[f"{kind.name} {process.returncode}"] += 1
        if "Traceback" in told:
            self.note("traceback" if OURS.search(told) else BEFORE_US, f"{label}: {told.splitlines()[-1]}")
        if took > 1.0 and kind != signal.SIGKILL and "stopping, and keeping" not in told:
            self.note("slow to stop", f"{label}: {took:.1f} s, load average {os.getloadavg()[0]:.1f}")
        self.look(place, label)
        if name.startswith("solve") and kind != signal.SIGKILL:
            self.kept(place, COMMANDS[name][1], label)
        again = self.start(name, place, cache)
        _, told = again.communicate(timeout=PATIENCE)
        if again.returncode != 0:
            self.note("next run fails", f"{label}: exit code {again.returncode}: {told}")
        self.look(place, f"{label}, next run")
        shutil.rmtree(place)
        shutil.rmtree(cache, ignore_errors=True)

    def look(self, place: Path, label: str) -> None:
        for path in place.rglob("*"):
            if path.is_file() and not _is_whole(path):
                self.note("half-written file", f"{label}: {path.name}")

    def kept(self, place: Path, scene: str, label: str) -> None:
        """What the log calls completed is in the results file of the scene."""
        log = place / "log"
        lines = log.read_text(encoding="utf-8").splitlines() if log.exists() else []
        done = {line.split('"')[1] for line in lines if 'analysis "' in line and ": completed" in line}
        path = (place / scene).with_suffix(".results.h5")
        have = set(Results(path).analyses) if path.exists() else set()
        if done - have:
            self.note("lost analysis", f"{label}: {done - have}")

    def note(self, what: str, text: str) -> None:
        self.found[what] += 1
        print(f"{what}: {text}", flush=True)


def _is_whole(path: Path) -> bool:
    try:
        if path.suffix == ".h5":
            read_modal_body(path) if is_modal_body_file(path) else Results(path).close()
        elif path.suffix == ".npz":
            np.load(path).close()
        elif path.suffix == ".fmu":
            zipfile.ZipFile(path).testzip()
        content = path.read_bytes()
        ends = {".html": b"</html>", ".png": b"IEND\xaeB`\x82"}
        return ".tmp" not in path.name and content.rstrip().endswith(ends.get(path.suffix, b""))
    except Exception as error:  # whatever is wrong with it
        print(f"{path}: {error}")
        return False


def main() -> None:
    """Prints what was found."""
    parser = options(__doc__, tries=100, seed=0)
    asked = parser.parse_args()
    with tempfile.TemporaryDirectory() as folder:
        campaign = Campaign(Path(folder), asked.seed)
        print({name: round(seconds, 1) for name, seconds in campaign.seconds.items()}, flush=True)
        for number in range(asked.tries):
            campaign.one(number)
    codes = ", ".join(f"{count} × {code}" for code, count in sorted(campaign.codes.items()))
    found = ", ".join(f"{campaign.found[kind]} × {kind}" for kind in KINDS)
    print(f"{asked.tries} signals, exit codes: {codes}; found: {found}")
    if asked.record:
        tried = (
            f"{asked.tries} signals (INT, TERM, KILL) at random times to {', '.join(COMMANDS)}; the same command again"
        )
        record("kills", tried=tried, found=found)
    sys.exit(any(campaign.found[kind] for kind in KINDS if kind != BEFORE_US))


if __name__ == "__main__":
    main()
