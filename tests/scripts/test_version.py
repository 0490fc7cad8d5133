"""The version is the same wherever it is stated, and installed."""

import re
import tomllib
from pathlib import Path

from ffrobot.common.version import program_version

ROOT = Path(__file__).parents[2]


def test_version_is_stated_alike():
    version = tomllib.loads((ROOT / "pyproject.toml").read_text(encoding="utf-8"))["project"]["version"]
    latest = re.search(r"^## (\S+?),? ", (ROOT / "CHANGELOG.md").read_text(encoding="utf-8"), re.MULTILINE)[1]
    cited = re.search(r"^version: (\S+)$", (ROOT / "CITATION.cff").read_text(encoding="utf-8"), re.MULTILINE)[1]
    assert version == latest == cited == program_version()
