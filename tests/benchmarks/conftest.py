"""What `ffrobot bench` measures, for tests of each part."""

import csv
from pathlib import Path

import pytest

REPOSITORY = Path(__file__).parents[2]


@pytest.fixture(scope="module")
def bench(ffrobot, tmp_path_factory):
    """Rows, dictionaries by column, of a part of `ffrobot bench`."""

    def rows(part, *options):
        folder = tmp_path_factory.mktemp(part)
        ffrobot.ok("bench", "--part", part, *options, "--source", REPOSITORY, "-o", folder)
        with (folder / f"{part}.csv").open(encoding="utf-8", newline="") as stream:
            return list(csv.DictReader(stream))

    return rows
