"""The version is the same wherever it is stated, and installed."""

import re
from importlib.metadata import version
from pathlib import Path

from ffrobot.common.version import VERSION

ROOT = Path(__file__).parents[2]


def test_version_is_stated_alike():
    latest = re.search(r"^## (\S+?),? ", (ROOT / "CHANGELOG.md").read_text(encoding="utf-8"), re.MULTILINE)[1]
    cited = re.search(r"^version: (\S+)$", (ROOT / "CITATION.cff").read_text(encoding="utf-8"), re.MULTILINE)[1]
    assert VERSION == latest == cited == version("ffrobot")
