"""What `python -m bench` measures, for tests of each part."""

import csv
import gc
import os
import subprocess
import sys
from pathlib import Path

import pytest

REPOSITORY = Path(__file__).parents[2]


@pytest.fixture(scope="module")
def bench(tmp_path_factory):
    """Rows, dictionaries by column, of a part of `python -m bench`."""

    def rows(part, *options):
        folder = tmp_path_factory.mktemp(part)
        command = [sys.executable, "-m", "bench", "--part", part, *options, "-o", folder]
        subprocess.run(command, env=os.environ | {"PYTHONPATH": str(REPOSITORY / "tools")}, check=True)
        with (folder / f"{part}.csv").open(encoding="utf-8", newline="") as stream:
            return list(csv.DictReader(stream))

    return rows


@pytest.fixture(autouse=True)
def without_what_other_tests_left():
    """The garbage collector looks through what is measured alone, not through a heap of other tests."""
    gc.collect()
    gc.freeze()
    yield
    gc.unfreeze()
