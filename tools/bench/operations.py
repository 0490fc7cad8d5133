"""Operations and memory traffic of one evaluation: the general core and the two-link case written by hand.

    .venv/bin/python tools/bench/operations.py

counts them with valgrind (lackey and callgrind), which has to be installed, in builds for AVX2, which is what valgrind
knows: the difference of runs of 3 000 and of 1 000 evaluations. Some minutes.
"""

import importlib.util
import os
import re
import subprocess
import sys
from pathlib import Path
from tempfile import TemporaryDirectory

ROOT = Path(__file__).parents[2]
sys.path.insert(0, str(ROOT / "tools"))
SCENE = ROOT / "cases" / "two_link" / "scene.toml"
FEW, MANY = 1_000, 3_000
TARGET = "-march=x86-64-v3"
BYTES = {"I8": 1, "I16": 2, "I32": 4, "I64": 8, "F64": 8, "V128": 16, "V256": 32}


def build_core(folder):
    """The compiled module for AVX2: of the portable ones the faster."""
    import nanobind

    options = ["-GNinja", "-DCMAKE_BUILD_TYPE=Release", "-DFFROBOT_NATIVE=OFF"]
    python = [f"-Dnanobind_DIR={nanobind.cmake_dir()}", f"-DPython_EXECUTABLE={sys.executable}"]
    subprocess.run(["cmake", "-S", ROOT, "-B", folder, *options, *python], check=True, stdout=subprocess.DEVNULL)
    subprocess.run(["ninja", "-C", folder, "_core_v3"], check=True, stdout=subprocess.DEVNULL)
    return next(folder.glob("_core_v3*.so"))


def two_link():
    from ffrobot.run.solve import prepare_scene
    from ffrobot.run.watcher import Watcher

    return prepare_scene(SCENE, Watcher()).model


def evaluate(core, count):
    """What the counted process does: the model, then `count` evaluations by the module at `core`."""
    import ffrobot.mbs

    spec = importlib.util.spec_from_file_location("ffrobot.mbs._core", core)
    module = importlib.util.module_from_spec(spec)
    sys.modules[spec.name] = ffrobot.mbs._core = module
    spec.loader.exec_module(module)
    from bench.hand_written import TIME, evaluation_seconds, general_state

    evaluation_seconds(general_state(two_link()), TIME, count)


def counted(*command):
    """{what: count} of a process: instructions, loads, stores and operations by type."""
    collected = re.search(r"Collected : (\d+)", _under("--tool=callgrind", "--callgrind-out-file=/dev/null", command))
    found = {"instructions": _number(collected[1])}
    for line in _under("--tool=lackey", "--basic-counts=no", "--detailed-counts=yes", command).splitlines():
        if match := re.search(r"==\s+([IFV]\d+)\s+([\d,]+)\s+([\d,]+)\s+([\d,]+)", line):
            for what, number in zip(("loads", "stores", "operations"), match.groups()[1:], strict=True):
                found[f"{match[1]} {what}"] = _number(number)
    return found


def _under(*tool_and_command):
    """What a tool of valgrind tells of a command."""
    *tool, command = tool_and_command
    environment = os.environ | {"PYTHONHASHSEED": "0"}  # or every run differs by some
    done = subprocess.run(
        ["valgrind", *tool, *map(str, command)], env=environment, capture_output=True, text=True, check=True
    )
    return done.stderr


def _number(text):
    return int(text.replace(",", ""))


def per_evaluation(command):
    """Counts of one evaluation; `command(count)` makes `count` of them."""
    few, many = counted(*command(FEW)), counted(*command(MANY))
    one = {what: (many[what] - few[what]) / (MANY - FEW) for what in few}
    for what in ("loads", "stores"):
        one[f"bytes of {what}"] = sum(size * one[f"{kind} {what}"] for kind, size in BYTES.items())
    return one


def main():
    from bench.hand_written import FLAGS, HandWritten

    with TemporaryDirectory() as name:
        folder = Path(name)
        core = build_core(folder / "core")
        flags = [TARGET if flag == "-march=native" else flag for flag in FLAGS]
        program = HandWritten(ROOT, two_link(), folder, flags)
        general = per_evaluation(lambda count: (sys.executable, __file__, core, count))
        by_hand = per_evaluation(lambda count: program.command(count, 0))
    print(f"{'of one evaluation':20} {'general':>10} {'by hand':>10} {'ratio':>6}")
    for what, number in general.items():
        if number >= 10 and by_hand[what] >= 1:
            print(f"{what:20} {number:10.0f} {by_hand[what]:10.0f} {number / by_hand[what]:6.2f}")


if __name__ == "__main__":
    if len(sys.argv) == 3:
        evaluate(sys.argv[1], int(sys.argv[2]))
    else:
        main()
