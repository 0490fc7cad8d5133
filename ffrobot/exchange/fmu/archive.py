"""The file of an FMU: names of platforms, of the model, and the archive itself."""

from __future__ import annotations

import re
import zipfile
from collections.abc import Mapping
from io import BytesIO

LONGEST = 60  # characters of a name in the identifier
DATE = (1980, 1, 1, 0, 0, 0)  # of all files in it: the same model is the same FMU, byte for byte
PLATFORMS: Mapping[tuple[str, str], tuple[str, str]] = {
    ("linux", "x86_64"): ("linux64", ".so"),
    ("linux", "i686"): ("linux32", ".so"),
    ("darwin", "x86_64"): ("darwin64", ".dylib"),
    ("darwin", "arm64"): ("darwin64", ".dylib"),
    ("win32", "AMD64"): ("win64", ".dll"),
}
"""By system and processor: FMI 2.0's name of the platform, and the end of a library's name there."""


def identifier_of(scene: str, analysis: str) -> str:
    """Of C, and in the name of the binary."""
    plain = re.sub(r"[^A-Za-z0-9_]", "_", f"{scene}_{analysis}")[:LONGEST]
    return plain if plain[0].isalpha() else f"robot_{plain}"[:LONGEST]


def zipped(content: Mapping[str, bytes]) -> bytes:
    """Files by name in one archive."""
    archive = BytesIO()
    with zipfile.ZipFile(archive, "w", zipfile.ZIP_DEFLATED) as file:
        for name, data in content.items():
            file.writestr(zipfile.ZipInfo(name, DATE), data, zipfile.ZIP_DEFLATED)
    return archive.getvalue()
