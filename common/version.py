"""The version of the program, and hashes of its code and of what files contain."""

import hashlib
import json
from functools import cache
from pathlib import Path

VERSION = "0.2.0"
"""As files and reports state it, and as the build reads it."""


@cache
def digest_of_code(folder: Path) -> str:
    """SHA-256 of the Python files below `folder`, to recognize results of another state of the program."""
    digest = hashlib.sha256()
    for file in sorted(folder.rglob("*.py")):
        digest.update(f"{file.relative_to(folder).as_posix()}\0".encode() + file.read_bytes() + b"\0")
    return digest.hexdigest()


def digest_of_content(content: object) -> str:
    """SHA-256 of nested tables and lists, independent of the order of keys."""
    return hashlib.sha256(json.dumps(content, sort_keys=True, default=str).encode()).hexdigest()
