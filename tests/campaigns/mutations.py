"""Every key of every case, and of scenes in 3D, with hostile values: what is solved, refused, or falls over.

    python tests/campaigns/mutations.py [--count 100] [--seed 0] [--case NAME …] [--record]

Run by hand, about half a second each. Every scene is cut short, and its scene, link or figure file changed in one
place: values of other types, huge, tiny, not finite, empty, nested, with markup and line breaks, keys removed, added,
doubled, damage to the text. Keys take turns, values are drawn. The command runs in a forked process with limits of time
and memory, and after `solve` the commands that read its results. Exit code 1 where anything fell over: a
traceback, a crash, no end within five minutes, a message that names no file, other words on stderr.
"""

import os
import random
import shutil
import sys
import tempfile
import tomllib
from collections import Counter
from contextlib import suppress
from pathlib import Path
from typing import Any, NamedTuple

import tomli_w
from forked_command import BAD, GOOD, Outcomes, outcome, run
from hostile import Mutator, known_keys, places
from record import options, record

ROOT = Path(__file__).parents[2]
CASES = ROOT / "cases"
CHECKPOINTS = ROOT / "tests" / "checkpoints" / "spatial"
IN_SPACE = ("arm3_line_static", "stanford", "slider_crank_3d")
OUTPUTS = 10  # of each analysis


class Case(NamedTuple):
    """A case cut short: its `folder`, and the TOML files that can be changed."""

    folder: Path
    files: list[Path]


def shortened(scene: dict[str, Any]) -> dict[str, Any]:
    """With a few outputs an analysis, and a limit of steps."""
    ends = {}
    for analysis in scene["analysis"]:
        if analysis["kind"] in ("pcid", "fcid", "forward") and "end" in analysis:
            ends[analysis["name"]] = analysis["end"] = OUTPUTS * analysis["output_step"]
        if analysis["kind"] == "motors-only" and analysis["end"] / analysis["output_step"] > 100:
            analysis["output_step"] = analysis["end"] / 50
        if analysis["kind"] in ("pcid", "forward", "closed-loop"):
            analysis.setdefault("max_steps", 50_000)
        if analysis["kind"] == "closed-loop" and analysis.get("actuation") in ends:
            analysis["end"] = ends[analysis["actuation"]]
        if "times" in analysis and analysis.get("about") in ends:
            analysis["times"] = [0.0, ends[analysis["about"]]]
    return scene


class Campaign:
    def __init__(self, folder: Path, seed: int, cases: list[str] | None = None) -> None:
        self.folder, self.chance, self.found = folder, random.Random(seed), Outcomes()
        os.environ["XDG_CACHE_HOME"] = str(folder / "cache")
        for name in ("OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS"):
            os.environ[name] = "1"
        ready = folder / "ready"
        shutil.copytree(CASES, ready, ignore=shutil.ignore_patterns("*.h5", "figures", "README.md"))
        for name in IN_SPACE:
            case = ready / f"checkpoint_{name}"  # cases may have the same name
            shutil.copytree(CHECKPOINTS / "links", case / "links")
            shutil.copy(CHECKPOINTS / f"{name}.toml", case / "scene.toml")
        names = sorted(path.parent.name for path in ready.glob("*/scene.toml"))
        self.cases = [self.prepared(ready / name) for name in names if cases is None or name in cases]
        keys = {
            key for case in self.cases for file in case.files for key in known_keys(tomllib.loads(file.read_text()))
        }
        self.mutator = Mutator(self.chance, sorted(keys))
        self.turns = [
            (case, file, place)
            for case in self.cases for file in case.files for place in places(tomllib.loads(file.read_text()))
        ]  # fmt: skip
        self.chance.shuffle(self.turns)

    def prepared(self, folder: Path) -> Case:
        """Cut short, its links in the cache."""
        scene = folder / "scene.toml"
        data = shortened(tomllib.loads(scene.read_text(encoding="utf-8")))
        scene.write_text(tomli_w.dumps(data), encoding="utf-8")
        links = {folder / body["link"] for body in data["body"] if isinstance(body.get("link"), str)}
        files = [scene, *sorted(path.resolve() for path in links), *folder.glob("figures.toml")]
        code, told = run(["solve", "scene.toml", "-o", "scene.results.h5"], folder)
        print(f"{folder.name}: exit code {code} {told.strip()[:200]}", flush=True)
        return Case(folder, files)

    def one(self, number: int) -> None:
        case, file, place = self.turns[number % len(self.turns)]
        ready, root = case.folder.parent, self.folder / "try"
        shutil.rmtree(root, ignore_errors=True)
        for name in {one.relative_to(ready).parts[0] for one in case.files}:
            shutil.copytree(ready / name, root / name)
        folder, changed = root / case.folder.name, root / file.relative_to(ready)
        os.symlink("loop", folder / "loop")
        text = changed.read_text(encoding="utf-8")
        if self.chance.random() < 0.04:
            content, how = self.mutator.damage(text)
        else:
            data = tomllib.loads(text)
            how = self.mutator.mutate(data, place)
            try:
                content = tomli_w.dumps(data).encode()
            except (TypeError, ValueError, RecursionError) as error:
                content, how = b"x = [" + b"[" * 500, f"{how}: {error}"
        changed.write_bytes(content)
        label = f"{number}: {folder.name}/{file.name}: {how}"
        names = ["scene.toml", *(f.name for f in case.files), "loop", "output"]
        if changed.name == "figures.toml":
            named = [path.name for path in folder.iterdir()]
            self.command(["plot", "scene.results.h5", "--format", "png"], folder, label, named)
            return
        (folder / "scene.results.h5").unlink()
        kind = self.command(["solve", "scene.toml"], folder, label, names)
        if (folder / "scene.results.h5").exists() and (kind == "solved" or self.chance.random() < 0.1):
            self.read(folder, label)

    def read(self, folder: Path, label: str) -> None:
        """The commands that read results: each now and then."""
        results = "scene.results.h5"
        commands = [["info", results], ["feasibility", results], ["linear", results], ["report", results],
                    ["plot", results, "--format", "png"],
                    ["view", results, "--frames", "3", "--no-pictures"]]  # fmt: skip
        for command in commands:
            if self.chance.random() < 0.1:
                self.command(command, folder, label, [results, "figures.toml"])

    def command(self, arguments: list[str], folder: Path, label: str, files: list[str]) -> str:
        code, told = run(arguments, folder)
        return self.found.add(arguments[0], outcome(code, told, files), label, code, told)


def main() -> None:
    """Prints what was found."""
    parser = options(__doc__, count=100, seed=0)
    parser.add_argument("--case", action="append", help="only this one; repeatable")
    asked = parser.parse_args()
    with tempfile.TemporaryDirectory() as folder, suppress(KeyboardInterrupt):
        runs = Campaign(Path(folder), asked.seed, asked.case)
        print(f"{len(runs.turns)} keys", flush=True)
        for number in range(asked.count):
            runs.one(number)
    found = runs.found
    found.show()
    if asked.record:
        kinds = Counter({kind: 0 for kind in (*BAD, *GOOD)})
        for key, number in found.counts.items():
            kinds[key.partition(": ")[2]] += number
        tried = (
            f"{asked.count} single changes of keys and text in scene, link and figure files of all cases, and of"
            f" {len(IN_SPACE)} 3D scenes, cut short;"
            f" {found.counts.total()} commands: solve, and those that read results"
        )
        record("mutations", tried=tried, found=", ".join(f"{kinds[kind]} × {kind}" for kind in (*GOOD, *BAD)))
    sys.exit(bool(found.bad))


if __name__ == "__main__":
    main()
