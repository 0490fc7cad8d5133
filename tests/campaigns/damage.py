"""Files damaged at random: modal bodies and results are refused with one message, never read as if nothing were wrong.

    python tests/campaigns/damage.py FILE.h5 … [--tries 1000] [--seed 0] [--record]

Each try damages one of the FILEs in one of the ways below and reads all of it in a process of its own, which may end by
a signal or take for ever. Exit code 1 where anything but a refusal was found.
"""

import os
import random
import signal
import sys
import tempfile
from collections import Counter
from pathlib import Path

import h5py
import numpy as np
from record import options, record

from ffrobot.common.errors import FfrobotError
from ffrobot.fe_models.modal_body_file import is_modal_body_file, read_modal_body
from ffrobot.results.file import Results

PAGE = 4096  # bytes
SECONDS = 10  # then reading counts as hung


class Damage:
    """Ways to damage the content of a file in place."""

    def __init__(self, chance: random.Random) -> None:
        self.chance = chance
        self.ways = (
            self.bit, self.bits, self.zeros, self.noise, self.lost_end, self.noise_at_the_end, self.cut, self.grown,
            self.pages_swapped, self.without_checksum,
        )  # fmt: skip

    def bit(self, content: bytearray) -> None:
        content[self.chance.randrange(len(content))] ^= 1 << self.chance.randrange(8)

    def bits(self, content: bytearray) -> None:
        for _ in range(4):
            self.bit(content)

    def _part(self, content: bytearray) -> slice:
        length = self.chance.choice([64, 512, PAGE])
        first = self.chance.randrange(max(1, len(content) - length))
        return slice(first, min(first + length, len(content)))

    def _end(self, content: bytearray) -> slice:
        return slice(len(content) - int(len(content) ** self.chance.random()), len(content))

    def zeros(self, content: bytearray) -> None:
        part = self._part(content)
        content[part] = bytes(part.stop - part.start)

    def noise(self, content: bytearray) -> None:
        part = self._part(content)
        content[part] = self.chance.randbytes(part.stop - part.start)

    def lost_end(self, content: bytearray) -> None:
        part = self._end(content)
        content[part] = bytes(part.stop - part.start)

    def noise_at_the_end(self, content: bytearray) -> None:
        part = self._end(content)
        content[part] = self.chance.randbytes(part.stop - part.start)

    def cut(self, content: bytearray) -> None:
        del content[self.chance.randrange(len(content)) :]

    def grown(self, content: bytearray) -> None:
        content += self.chance.randbytes(self.chance.randrange(1, PAGE))

    def pages_swapped(self, content: bytearray) -> None:
        one, two = (PAGE * self.chance.randrange(len(content) // PAGE) for _ in range(2))
        content[one : one + PAGE], content[two : two + PAGE] = content[two : two + PAGE], content[one : one + PAGE]

    def without_checksum(self, content: bytearray) -> None:
        del content[-60:]
        self.bits(content)


def read_all(path: Path) -> None:
    """Everything in the file, as any command reads it."""
    if is_modal_body_file(path):
        read_modal_body(path)
        return
    with Results(path) as results, h5py.File(path) as file:
        names: list[str] = []
        file.visititems(lambda name, item: names.append(name) if isinstance(item, h5py.Dataset) else None)
        for name in names:
            np.asarray(results[name])


def outcome(path: Path) -> str:
    """How reading it in a process of its own ends."""
    child = os.fork()
    if child == 0:
        signal.alarm(SECONDS)
        try:
            read_all(path)
        except FfrobotError as error:
            os._exit(2 if str(path) in str(error) and "\n" not in str(error) else 3)
        except BaseException:
            os._exit(3)
        os._exit(0)
    _, status = os.waitpid(child, 0)
    if os.WIFSIGNALED(status):
        return "hung" if os.WTERMSIG(status) == signal.SIGALRM else "crashed"
    return {0: "read as if sound", 2: "rejected"}.get(os.WEXITSTATUS(status), "other error")


def main() -> None:
    """Prints what was found."""
    parser = options(__doc__, tries=1000, seed=0)
    parser.add_argument("files", metavar="FILE.h5", type=Path, nargs="+")
    asked = parser.parse_args()
    chance, found = random.Random(asked.seed), Counter[str]()
    damage = Damage(chance)
    contents = [path.read_bytes() for path in asked.files]
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder) / "damaged.h5"
        for number in range(asked.tries):
            whole, way = chance.choice(contents), damage.ways[number % len(damage.ways)]
            content = bytearray(whole)
            way(content)
            path.write_bytes(content)
            end = outcome(path) if content != whole else "unchanged"
            found[end] += 1
            if end not in ("rejected", "unchanged"):
                print(f"{number}: {way.__name__}: {end}", flush=True)
    ends = ("rejected", "unchanged", "read as if sound", "crashed", "hung", "other error")
    counts = ", ".join(f"{found[end]} × {end}" for end in ends)
    print(f"{asked.tries} damaged files: {counts}")
    if asked.record:
        ways = ", ".join(way.__name__.replace("_", " ") for way in damage.ways)
        record("damage", tried=f"{asked.tries} modal bodies and results files damaged at random: {ways}", found=counts)
    sys.exit(any(found[end] for end in ends[2:]))


if __name__ == "__main__":
    main()
