"""Mechanisms and states of tests/checkpoints/spatial, numbers of an independent code, for the oracle and the core."""

import json
from functools import cache
from pathlib import Path

FOLDER = Path(__file__).parents[1] / "checkpoints" / "spatial"
CASES = sorted(path.stem for path in FOLDER.glob("*.toml"))


@cache
def load(name):
    return json.loads((FOLDER / f"{name}.json").read_text())
