"""C sources of an FMU, and its binary for the platform that they are compiled on."""

from __future__ import annotations

import os
import platform
import shlex
import shutil
import subprocess
import sys
import tempfile
from collections.abc import Mapping
from pathlib import Path

import numpy as np
from scipy.linalg import matrix_balance

from ...actuation.control.linear_model import LinearModel
from ...common.arrays import Array
from .archive import PLATFORMS
from .description import SOURCE, Unit

HEADER = "model.h"
COMPILERS = ("cc", "gcc", "clang")


def sources(unit: Unit) -> dict[str, str]:
    """Text of each source file by name."""
    return {SOURCE: (Path(__file__).parent / "c" / SOURCE).read_text(encoding="utf-8"), HEADER: _header(unit)}


def numbers(model: LinearModel) -> str:
    """The matrices as C, with the scale of the states that balances A (what A is in units of the scale)."""
    _, (scale, _) = matrix_balance(model.A, permute=False, separate=True)
    arrays = {"A": model.A, "B": model.B, "C": model.C, "D": model.D, "SCALE": scale[None, :]}
    return "\n".join(_array(name, values) for name, values in arrays.items())


def _header(unit: Unit) -> str:
    sizes = {"N_X": unit.states, "N_U": unit.inputs, "N_Y": unit.outputs}
    lines = [f"/* {_comment(unit.name)}: {_comment(unit.description)} */", f'#define GUID "{unit.guid}"']
    lines += [f"#define {name} {len(variables)}" for name, variables in sizes.items()]
    for title, variables in zip(("States", "Inputs", "Outputs"), sizes.values(), strict=True):
        names = "\n".join(f"     {_comment(each.name)} ({each.unit})" for each in variables)
        lines += ["", f"/* {title}:\n{names} */"]
    return "\n".join([*lines, "", numbers(unit.model), ""])


def _comment(text: str) -> str:
    return text.replace("*/", "* /").replace("/*", "/ *")


def _array(name: str, values: Array) -> str:
    rows = ",\n".join("    " + ", ".join(np.format_float_scientific(x, trim="0") for x in row) for row in values)
    return f"static const double {name}[] = {{\n{rows}}};\n"


def binary(unit: Unit, files: Mapping[str, str]) -> tuple[str, bytes] | str:
    """Name within the FMU and content of the library for this platform; why there is none, where there is none.

    It is compiled by the environment's CC, else by the first of `COMPILERS` on the path.
    """
    place = PLATFORMS.get((sys.platform, platform.machine()))
    if place is None:
        return f"FMI 2.0 has no name for {sys.platform} on {platform.machine()}"
    compiler = _compiler()
    if compiler is None:
        return f"found no C compiler ({', '.join(COMPILERS)}, or what CC names)"
    folder, suffix = place
    with tempfile.TemporaryDirectory(prefix="ffrobot-fmu-") as temporary:
        for name, text in files.items():
            (Path(temporary) / name).write_text(text, encoding="utf-8")
        output = f"{unit.identifier}{suffix}"
        command = [*compiler, "-std=c99", "-O2", "-fPIC", "-shared", "-o", output, SOURCE, "-lm"]
        try:
            done = subprocess.run(command, cwd=temporary, capture_output=True, text=True, check=False)
        except OSError as error:
            return f"{shlex.join(compiler)} does not run: {error.strerror or error}"
        if done.returncode:
            reason = (done.stderr.strip() or done.stdout.strip() or "no message").splitlines()[-1]
            return f"{shlex.join(compiler)} failed: {reason}"
        return f"binaries/{folder}/{output}", (Path(temporary) / output).read_bytes()


def _compiler() -> list[str] | None:
    if named := shlex.split(os.environ.get("CC", "")):
        return named
    found = next((name for name in COMPILERS if shutil.which(name)), None)
    return [found] if found else None
