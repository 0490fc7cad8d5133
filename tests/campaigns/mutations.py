"""Every key of every case, and of scenes in space, with hostile values: what is solved, refused, or falls over.

    python tests/campaigns/mutations.py [--count 100] [--seed 0] [--case NAME …] [--folder FOLDER] [--record]

Run by hand, about half a second each. Every scene is cut short, and its scene, link or figure file changed in one
place: values of other types, huge, tiny, not finite, empty, nested, with markup and line breaks, keys removed, added,
doubled, damage to the text. Keys take turns, values are drawn. The command runs in a process forked from this one, with
limits of time and memory, and after `solve` the commands that read its results. Exit code 1 where anything fell over: a
traceback, a crash, no end within a minute of processor time, a message that names no file, other words on stderr.
"""

import argparse
import copy
import json
import os
import random
import re
import resource
import shutil
import signal
import sys
import tempfile
import time
import tomllib
from collections import Counter
from collections.abc import Iterator
from contextlib import suppress
from dataclasses import dataclass, field
from datetime import date
from importlib import import_module
from pathlib import Path
from typing import Any

import tomli_w
from record import record

sys.path.append(str(Path(__file__).parents[1] / "checkpoints" / "spatial"))
from scene_of import scene

ROOT = Path(__file__).parents[2]
CASES = ROOT / "cases"
CHECKPOINTS = ROOT / "tests" / "checkpoints" / "spatial"
IN_SPACE = ("arm3_line_static", "stanford", "slider_crank_3d")
CPU_TIME = 60  # s for one command
PATIENCE = 600  # s of wall time: something waits for ever
MEMORY = 8 << 30  # bytes of address space
OUTPUTS = 10  # of each analysis
GOOD = ("solved", "refused", "stopped")
BAD = ("traceback", "crash", "hang", "no file named", "noise")
LOADED_ONCE = (
    "h5py",
    "scipy.linalg",
    "scipy.optimize",
    "scipy.interpolate",
    "ffrobot.run.solve",
    "ffrobot.results.write",
    "ffrobot.results.resume",
    "matplotlib.backends.backend_agg",
    "ffrobot.cli",
    "ffrobot.pictures.figures.plot",
    "ffrobot.pictures.report",
    "ffrobot.present.summary",
)

NAMES = [
    "", " ", ".", "..", "a/b", "a.b", "$x", "$\\bad{$", "a_b^c", "\\", "<b>x</b>", "</script>", "&amp;", "{{ 7*7 }}",
    "[red]x[/]", "%s%n", "line\nbreak", "tab\there", "nul\0", "\x1b[31m", "größe", "関節", "🤖", "e\u0301", "\u202e",
    "ground", "mid", "root", "CON", "-o", "~", "'\"", "a" * 300, "x" * 100_000, "time", "resume",
]  # fmt: skip
NUMBERS = [
    0, -1, 1, 2, 3, 1.5, -0.0, 1e-320, 1e-300, 1e-30, 1e-12, 1e12, 1e30, 1e300, -1e300, 10**9, 10**18, -(10**18),
    2**31, 2**32, 2**63, 10**24, 10**400, float("nan"), float("inf"), float("-inf"),
]  # fmt: skip
OTHERS = [
    True, False, [], {}, [[]], [{}], [1, 2], [1.0, 2.0, 3.0], ["a"], {"a": 1}, [0.0] * 5000, ["0"] * 300,
    [1, "a", True, []], date(2020, 1, 1),
]  # fmt: skip
EXPRESSIONS = [
    "t", "0", "1/0", "1/t", "log(-1)", "exp(exp(20*t))", "where(t > 0.005, 1, 0)", "abs(t-0.005)", "sqrt(0.005-t)",
    "9**9**9", "(" * 300, "__import__('os')", "t" + "+t" * 5000, "1e308*10", "tan(1e9*t)", "0.1*sin(1e6*t)", "π",
    "lambda: 0", "2 t", "t**0.5",
]  # fmt: skip
FILES = [
    "", "/", "/dev/null", "/dev/zero", "nowhere.toml", "scene.toml", "link1.toml", "../x.toml", "a" * 5000,
    "nul\0.toml", "loop", "figures",
]  # fmt: skip


@dataclass
class Case:
    """A case cut short: its `folder`, the TOML files that can be changed, and how long it takes."""

    name: str
    folder: Path
    files: list[Path]
    seconds: float = 0.0


@dataclass
class Found:
    """Counts of outcomes, and what is to be mended."""

    counts: Counter[str] = field(default_factory=Counter)
    bad: list[str] = field(default_factory=list)


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
        if "times" in analysis and analysis.get("about") in ends:
            analysis["times"] = [0.0, ends[analysis["about"]]]
    return scene


def write_scene_in_space(name: str, folder: Path) -> None:
    text, links = scene(json.loads((CHECKPOINTS / f"{name}.json").read_text(encoding="utf-8")), 1e-5)
    folder.mkdir()
    (folder / "scene.toml").write_text(text, encoding="utf-8")
    for link in links:
        shutil.copy(CHECKPOINTS / link, folder)


def places(data: Any, here: tuple[int | str, ...] = ()) -> Iterator[tuple[int | str, ...]]:
    """Every key, every table of a list and the first of other entries, and the file as a whole as ()."""
    yield here
    if isinstance(data, list) and data and not isinstance(data[0], dict | list):
        yield (*here, 0)
        return
    for key, value in data.items() if isinstance(data, dict) else enumerate(data):
        if isinstance(value, dict | list):
            yield from places(value, (*here, key))
        else:
            yield (*here, key)


def known_keys(data: Any) -> Iterator[str]:
    for key, value in data.items() if isinstance(data, dict) else enumerate(data):
        if isinstance(key, str):
            yield key
        if isinstance(value, dict | list):
            yield from known_keys(value)


class Mutator:
    """Changes drawn from a seed."""

    def __init__(self, chance: random.Random, keys: list[str]) -> None:
        self.chance, self.keys = chance, keys

    def value(self, old: object) -> Any:
        kind = self.chance.random()
        if isinstance(old, int | float) and not isinstance(old, bool) and kind < 0.75:
            return self.number(old)
        if isinstance(old, str) and kind < 0.7:
            return self.text()
        if kind > 0.95:
            return self.nested(self.chance.choice([10, 50, 150, 400]))
        return copy.deepcopy(self.chance.choice([*NUMBERS, *OTHERS, *NAMES, *EXPRESSIONS]))

    def number(self, old: float) -> float:
        if self.chance.random() < 0.4:
            return old * 10.0 ** self.chance.uniform(-3, 3)
        return self.chance.choice([
            -old, old * 10.0 ** self.chance.randint(-40, 40), old * 10.0 ** self.chance.uniform(-4, 4),
            self.chance.choice(NUMBERS), int(old) if abs(old) < 1e300 else 0,
        ])  # fmt: skip

    def text(self) -> str:
        return self.chance.choice(self.chance.choice([NAMES, NAMES, EXPRESSIONS, FILES, self.keys]))

    def nested(self, depth: int) -> Any:
        value: Any = 1
        for _ in range(depth):
            value = [value] if self.chance.random() < 0.5 else {"a": value}
        return value

    def mutate(self, data: dict[str, Any], place: tuple[int | str, ...]) -> str:
        """Change `data` at `place`; says how."""
        if not place:
            key = self.chance.choice([*self.keys, *NAMES])
            data[key] = self.value(self.chance.choice(["text", 1.0]))
            return f"{key[:40]!r} = {str(data[key])[:60]!r} added"
        *way, last = place
        inner: Any = data
        for part in way:
            inner = inner[part]
        where = ".".join(map(str, place))
        how = self.chance.random()
        if how < 0.12:
            del inner[last]
            return f"{where} removed"
        if how < 0.2 and isinstance(inner, list):
            inner.append(copy.deepcopy(inner[last]))
            return f"{where} doubled"
        if how < 0.3 and isinstance(inner, dict):
            key = self.chance.choice([*self.keys, *NAMES])
            inner[key] = self.value(self.chance.choice(["text", 1.0]))
            return f"{where}: {key[:40]!r} = {str(inner[key])[:60]!r} added beside it"
        inner[last] = self.value(inner[last])
        if isinstance(last, str) and last in ("name", "body", "point") and isinstance(inner[last], str) and how > 0.7:
            return self.renamed(data, place, where)
        return f"{where} = {str(inner[last])[:80]!r}"

    def renamed(self, data: dict[str, Any], place: tuple[int | str, ...], where: str) -> str:
        """A body, joint or analysis with another name wherever it is used, so that the name gets far."""
        table, entry, _ = place if len(place) == 3 else ("", 0, "")
        name = self.chance.choice([name for name in NAMES if len(name) < 50])
        old = self.original.get(str(table), {}).get(entry) if table else None
        if isinstance(old, str):

            def replaced(value: Any) -> Any:
                if isinstance(value, dict):
                    return {name if k == old else k: replaced(v) for k, v in value.items()}
                if isinstance(value, list):
                    return [replaced(v) for v in value]
                if isinstance(value, str):
                    return (
                        name
                        if value == old
                        else f"{name}.{value.partition('.')[2]}"
                        if value.startswith(f"{old}.")
                        else value
                    )
                return value

            changed = replaced(copy.deepcopy(self.whole))
            data.clear()
            data.update(changed)
        return f"{where}: {old!r} renamed to {name!r}"

    def remember(self, data: dict[str, Any]) -> None:
        self.whole = data
        self.original = {
            key: {k: entry.get("name") for k, entry in enumerate(value) if isinstance(entry, dict)}
            for key, value in data.items() if isinstance(value, list)
        }  # fmt: skip

    def damage(self, text: str) -> tuple[bytes, str]:
        """The text of a file, damaged."""
        raw = text.encode()
        cut = self.chance.randrange(len(raw))
        lines = text.splitlines(keepends=True)
        doubled = self.chance.randrange(len(lines))
        kinds = {
            "byte order mark": b"\xef\xbb\xbf" + raw,
            "byte order mark of UTF-16": text.encode("utf-16"),
            "byte that is no UTF-8": raw[:cut] + b"\xff" + raw[cut:],
            "cut off": raw[:cut],
            "NUL": raw[:cut] + b"\0" + raw[cut:],
            "empty": b"",
            "deep list": raw + b"\nx = " + b"[" * 3000 + b"]" * 3000,
            "deep table": raw + b"\nx = " + b"{a=" * 2000 + b"1" + b"}" * 2000,
            "deep key": raw + b"\n" + b".".join([b"a"] * 3000) + b" = 1",
            "long integer": re.sub(rb"= \d[\d.e+-]*", b"= " + b"1" * 5000, raw, count=1),
            "line doubled": "".join([*lines[:doubled], lines[doubled], *lines[doubled:]]).encode(),
            "line removed": "".join([*lines[:doubled], *lines[doubled + 1 :]]).encode(),
            "CRLF": raw.replace(b"\n", b"\r\n"),
        }
        name = self.chance.choice(list(kinds))
        return kinds[name], name


def run(arguments: list[str], folder: Path, patience: float = PATIENCE) -> tuple[int, str]:
    """`ffrobot ARGUMENTS` in a forked process: exit code, negative for a signal, and what it wrote to stderr."""
    told = folder / "stderr.txt"
    child = os.fork()
    if child == 0:
        code = 70
        try:
            os.chdir(folder)
            os.setsid()
            resource.setrlimit(resource.RLIMIT_AS, (MEMORY, MEMORY))
            resource.setrlimit(resource.RLIMIT_CORE, (0, 0))
            resource.setrlimit(resource.RLIMIT_CPU, (CPU_TIME, CPU_TIME))
            os.dup2(os.open(told, os.O_WRONLY | os.O_CREAT | os.O_TRUNC), 2)
            os.dup2(os.open(os.devnull, os.O_WRONLY), 1)
            sys.argv = ["ffrobot", *arguments]
            from ffrobot.cli import main

            try:
                main()
                code = 0
            except SystemExit as end:
                code = end.code if isinstance(end.code, int) else int(end.code is not None)
            sys.stderr.flush()
        except BaseException as error:
            os.write(2, f"Traceback of the campaign: {type(error).__name__}: {error}".encode())
        finally:
            os._exit(code)
    began = time.monotonic()
    while time.monotonic() - began < patience:
        done, status = os.waitpid(child, os.WNOHANG)
        if done:
            text = told.read_text(encoding="utf-8", errors="replace") if told.exists() else ""
            return os.waitstatus_to_exitcode(status), text
        time.sleep(0.005)
    os.killpg(child, signal.SIGKILL)
    os.waitpid(child, 0)
    return -signal.SIGKILL, "no end"


def outcome(code: int, told: str, files: list[str]) -> str:
    """What became of one command."""
    lines = [line for line in told.splitlines() if line.strip()]
    if "Traceback" in told:
        return "traceback"
    if told == "no end" or code == -signal.SIGXCPU or (code == -signal.SIGKILL and not told):
        return "hang"
    if code < 0 or code not in (0, 1, 2):
        return "crash"
    if code == 0:
        return "noise" if lines else "solved"
    if not any(name in told for name in files):
        return "no file named"
    if not lines[0].startswith("ffrobot: "):
        return "noise"
    return "refused" if code == 2 else "stopped"


class Campaign:
    def __init__(self, folder: Path, seed: int, cases: list[str] | None = None) -> None:
        self.folder, self.chance, self.found = folder, random.Random(seed), Found()
        os.environ["XDG_CACHE_HOME"] = str(folder / "cache")
        for name in ("OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS"):
            os.environ[name] = "1"
        ready = folder / "ready"
        if not ready.exists():
            shutil.copytree(CASES, ready, ignore=shutil.ignore_patterns("*.h5", "figures", "README.md"))
            for name in IN_SPACE:
                write_scene_in_space(name, ready / f"checkpoint_{name}")  # cases may have the same name
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
        is_new = not (folder / "ready").exists()
        data = shortened(tomllib.loads(scene.read_text(encoding="utf-8")))
        scene.write_text(tomli_w.dumps(data), encoding="utf-8")
        links = {folder / body["link"] for body in data["body"] if isinstance(body.get("link"), str)}
        files = [scene, *sorted(path.resolve() for path in links), *folder.glob("figures.toml")]
        if not is_new:
            return Case(folder.name, folder, files)
        run(["solve", "scene.toml", "-o", "r.h5"], folder, 600)
        (folder / "ready").touch()
        began = time.monotonic()
        code, told = run(["solve", "scene.toml", "-o", "r.h5"], folder, 600)
        seconds = time.monotonic() - began
        (folder / "r.h5").rename(folder / "scene.results.h5")
        print(f"{folder.name}: {seconds:.2f} s, exit code {code} {told.strip()[:200]}", flush=True)
        return Case(folder.name, folder, files, seconds)

    def one(self, number: int) -> None:
        case, file, place = self.turns[number % len(self.turns)]
        root = self.folder / "try"
        shutil.rmtree(root, ignore_errors=True)
        shutil.copytree(case.folder.parent, root, ignore=lambda at, names: [] if Path(at) != case.folder.parent else [
            name for name in names if name not in {case.name, *(f.parent.name for f in case.files)}])  # fmt: skip
        folder, changed = root / case.name, root / file.relative_to(case.folder.parent)
        os.symlink("loop", folder / "loop")
        text = changed.read_text(encoding="utf-8")
        if self.chance.random() < 0.04:
            content, how = self.mutator.damage(text)
        else:
            data = tomllib.loads(text)
            self.mutator.remember(copy.deepcopy(data))
            how = self.mutator.mutate(data, place)
            try:
                content = tomli_w.dumps(data).encode()
            except (TypeError, ValueError, RecursionError) as error:
                content, how = b"x = [" + b"[" * 500, f"{how}: {error}"
        changed.write_bytes(content)
        label = f"{number}: {case.name}/{file.name}: {how}"
        names = ["scene.toml", *(f.name for f in case.files), "loop", "output"]
        if changed.name == "figures.toml":
            others = [path.name for path in folder.glob("*.csv")]
            self.command(
                ["plot", "scene.results.h5", "--format", "png"],
                folder,
                label,
                ["scene.results.h5", "figures.toml", *others],
            )
            return
        (folder / "scene.results.h5").unlink()
        kind = self.command(["solve", "scene.toml"], folder, label, names)
        if (folder / "scene.results.h5").exists() and (kind == "solved" or self.chance.random() < 0.1):
            self.read(folder, label, often="renamed" in how)

    def read(self, folder: Path, label: str, often: bool) -> None:
        """The commands that read results: each now and then, all for names."""
        results = "scene.results.h5"
        commands = [["info", results], ["feasibility", results], ["linear", results], ["report", results],
                    ["plot", results, "--format", "png"],
                    ["view", results, "--frames", "3", "--no-pictures"]]  # fmt: skip
        for command in commands:
            if often or self.chance.random() < 0.1:
                self.command(command, folder, label, [results, "figures.toml"])

    def command(self, arguments: list[str], folder: Path, label: str, files: list[str]) -> str:
        code, told = run(arguments, folder)
        kind = outcome(code, told, files)
        self.found.counts[f"{arguments[0]}: {kind}"] += 1
        if kind in BAD:
            lines = told.strip().splitlines()
            shown = " | ".join(lines[-3:] if kind == "traceback" else lines[:3])
            self.found.bad.append(f"{kind}, {arguments[0]}, exit code {code}: {label}: {shown[:600]}")
            print(self.found.bad[-1], flush=True)
        return kind


def campaign(seed: int, count: int, cases: list[str] | None = None, folder: Path | None = None) -> Found:
    """`count` changes drawn with `seed`; all cases, or those named."""
    with tempfile.TemporaryDirectory() as temporary, suppress(KeyboardInterrupt):
        runs = Campaign(folder or Path(temporary), seed, cases)
        print(f"{len(runs.turns)} keys", flush=True)
        for number in range(count):
            runs.one(number)
    return runs.found


def main() -> None:
    """Prints what was found."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--count", type=int, default=100)
    parser.add_argument("--seed", type=int, default=0)
    parser.add_argument("--case", action="append", help="only this one; repeatable")
    parser.add_argument("--folder", type=Path, help="where the cases and their links, ready for use, are and stay")
    parser.add_argument("--record", action="store_true", help="write what was found, for docs/stability.md")
    asked = parser.parse_args()
    for module in LOADED_ONCE:
        import_module(module)
    found = campaign(asked.seed, asked.count, asked.case, asked.folder)
    for kind, number in sorted(found.counts.items()):
        print(f"{number:6d} {kind}")
    if asked.record:
        kinds = Counter({kind: 0 for kind in (*BAD, *GOOD)})
        for key, number in found.counts.items():
            kinds[key.partition(": ")[2]] += number
        tried = (
            f"{asked.count} single changes of keys and text in scene, link and figure files of all cases, and of"
            f" {len(IN_SPACE)} scenes in space, cut short;"
            f" {found.counts.total()} commands: solve, and those that read results"
        )
        record("mutations", tried=tried, found=", ".join(f"{kinds[kind]} × {kind}" for kind in (*GOOD, *BAD)))
    sys.exit(bool(found.bad))


if __name__ == "__main__":
    main()
