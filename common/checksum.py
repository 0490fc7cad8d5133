"""Files that carry a checksum of all their bytes: damage is reported before a library fails on it.

The checksum stands behind the end of the HDF5 file, where HDF5 itself does not look: a line of text, zlib's CRC-32,
which takes a few percent of the time of reading. Libraries that change such a file cut the line off.
"""

import re
import zlib
from pathlib import Path
from typing import Literal

from .errors import InputError

MARK = "checksum"  # attribute at / of a file that has one, so that a missing line is noticed
METHOD = "crc32"
State = Literal["sound", "changed", "damaged", "none"]

_LINE = "\nffrobot checksum crc32 {:08x} of {:016d} bytes\n"
_RENEWED = _LINE.replace("checksum", "resealed")
_LENGTH = len(_LINE.format(0, 0))
_PATTERN = re.compile(rb"\nffrobot (checksum|resealed) crc32 ([0-9a-f]{8}) of (\d{16}) bytes\n")
_PIECE = 1 << 20  # read into the same memory again: fresh pages would cost as much as the sum itself


def sealed(content: bytes, line: str = _LINE) -> bytes:
    """Return `content`, followed by `line` filled in with its CRC-32 and length."""
    return content + line.format(zlib.crc32(content), len(content)).encode()


def seal(path: Path) -> None:
    """Renew the checksum at the end of a file that was changed on purpose."""
    content = path.read_bytes()
    content = content[:-_LENGTH] if _PATTERN.fullmatch(content[-_LENGTH:]) else content
    path.write_bytes(sealed(content, _RENEWED))


def state(path: Path) -> State:
    """State of the file at `path` by its checksum: "sound" as ffrobot wrote it, "changed" where `seal` renewed it.

    "none" without a checksum, else "damaged". Raises `OSError`.
    """
    with path.open("rb", buffering=0) as stream:
        size = stream.seek(0, 2) - _LENGTH
        if size < 0:
            return "none"
        stream.seek(size)
        line = _PATTERN.fullmatch(stream.read(_LENGTH))
        if line is None:
            return "none"
        if int(line[3]) != size:
            return "damaged"
        stream.seek(0)
        checksum, left, piece = 0, size, memoryview(bytearray(min(size, _PIECE)))
        while left > 0 and (count := stream.readinto(piece[: min(left, _PIECE)])):
            checksum, left = zlib.crc32(piece[:count], checksum), left - count
    if checksum != int(line[2], 16):
        return "damaged"
    return "sound" if line[1] == b"checksum" else "changed"


def refuse(path: Path) -> InputError:
    """Return the error for a file whose content contradicts its checksum."""
    return InputError(
        f"{path}: damaged file: its content is not what its checksum was made of; make it again, or, if it was changed"
        " on purpose, renew the checksum (ffrobot.common.checksum.seal)"
    )
