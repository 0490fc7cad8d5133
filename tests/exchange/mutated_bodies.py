"""SID and .fem files changed at random: read, or refused in one line that names the file.

    python tests/exchange/mutated_bodies.py [--count 300] [--seed 0]

Anything else (a traceback, a warning of Python's, no end within ten seconds) is printed, and is exit code 1.
"""

import argparse
import random
import re
import signal
import sys
import tempfile
import traceback
import warnings
from collections import Counter
from pathlib import Path

from beam_links import beam_link, circle

import ffrobot
from ffrobot.common.errors import InputError
from ffrobot.exchange.bodies.mbdyn import fem_text
from ffrobot.exchange.bodies.sid import sid_text
from ffrobot.exchange.export import import_body

NUMBER = re.compile(r"[-+]?\d+(?:\.\d+)?(?:[eEdD][-+]?\d+)?")
VALUES = (
    "nan", "inf", "-inf", "1e300", "-1e300", "1e-300", "0", "-1", "1.5", "2", "99999999999999999999", "2147483648", "",
    " ", "x", "--", "1,", ",1", "1 2", "1e", "D", "0x10", "1_0", "٣", "(", ")", "=", "1e999", "1D+200", "-0.0",
)  # fmt: skip
CONDITIONS = ("cantilever", "simply-supported", "craig-bampton")
SECONDS = 10


def texts():
    """A file of each format and reference condition, short ones."""
    found = {}
    for condition in CONDITIONS:
        link = beam_link(
            0.6,
            circle(0.02),
            2,
            condition=condition,
            name="arm",
            modes={"count": 1, "family": ["in-plane-bending", "torsion"]},
        )
        body = ffrobot.make_link(link).body
        found[condition, ".SID_FEM"], found[condition, ".fem"] = sid_text(body)[0], fem_text(body)[0]
    return found


def mutated(text, draw):
    """Changed in one to three places."""
    for _ in range(draw.choice([1, 1, 2, 3])):
        text = draw.choice([_number, _number, _number, _lines, _lines, _characters, _index, _whole])(text, draw)
    return text


def _number(text, draw):
    places = list(NUMBER.finditer(text))
    if not places:
        return text
    place = draw.choice(places)
    return text[: place.start()] + draw.choice(VALUES) + text[place.end() :]


def _lines(text, draw):
    """Lines that are gone, doubled, moved, or in another's place; also a block of them."""
    lines = text.splitlines()
    first = draw.randrange(len(lines) or 1)
    size = draw.choice([1, 1, 1, 3, 12])
    block = lines[first : first + size]
    rest = lines[:first] + lines[first + size :]
    other = draw.randrange(len(rest) + 1)
    kinds = {
        "gone": rest,
        "doubled": lines[:first] + block + block + lines[first + size :],
        "moved": rest[:other] + block + rest[other:],
        "copied": lines[:other] + block + lines[other:],
    }
    return "\n".join(kinds[draw.choice(sorted(kinds))]) + "\n"


def _characters(text, draw):
    at, size = draw.randrange(len(text) + 1), draw.choice([0, 1, 1, 2, 5, 40])
    new = draw.choice(["", "=", "(", ")", ",", "end", "\n", "\0", "é", "**", "new ", " ", "\u2028", "9", "-"])
    return text[:at] + new + text[at + size :]


def _index(text, draw):
    places = list(re.finditer(r"m[01]\s*\([^)]*\)|nrow\s*=\s*\d+|ncol\s*=\s*\d+|nelastq\s*=\s*\d+|\d+ \d+ 0 0 0", text))
    if not places:
        return _number(text, draw)
    place = draw.choice(places)
    new = draw.choice(["m0( 1, )", "m0(,)", "m1( 1)", "m0( 0, 1)", "m1( 1, 1, 1, 1)", "m0( 1", "nrow = 99999999"])
    return text[: place.start()] + new + text[place.end() :]


def _whole(text, draw):
    at = draw.randrange(len(text) + 1)
    parts = [text[:at], text[at:], "", text * 2, "\ufeff" + text, text.upper(), text.lower()]
    return draw.choice([*parts, text.replace("\n", "\r\n"), text.replace("=", " "), text.replace(" ", "\t")])


class _Late(Exception):  # noqa: N818
    pass


def _too_late(*_):
    raise _Late


def outcome(path, text):
    """How it ended: "read", "refused", or what is wrong with that."""
    path.write_bytes(text.encode("utf-8", "surrogatepass"))
    signal.signal(signal.SIGALRM, _too_late)
    signal.alarm(SECONDS)
    try:
        with warnings.catch_warnings():
            warnings.simplefilter("error")
            import_body(path, path.parent / "body.h5")
    except InputError as error:
        told = str(error)
        if not told.startswith(f"{path}: ") or "\n" in told or len(told) > len(str(path)) + 500:
            return f"message: {told}"
        return "rejected"
    except Exception:
        return traceback.format_exc()
    finally:
        signal.alarm(0)
        (path.parent / "body.h5").unlink(missing_ok=True)
    return "read"


def campaign(count, seed, folder):
    """Counts of outcomes, and the others with what was changed."""
    given, counts, bad = texts(), Counter(), []
    for number in range(count):
        draw = random.Random(f"{seed} {number}")
        condition, suffix = draw.choice(sorted(given))
        text = mutated(given[condition, suffix], draw)
        found = outcome(folder / f"a{suffix}", text)
        counts[found if found in ("read", "rejected") else "bad"] += 1
        if found not in ("read", "rejected"):
            bad.append(f"{seed} {number} {condition} {suffix}: {found}")
    return counts, bad


if __name__ == "__main__":
    parser = argparse.ArgumentParser()
    parser.add_argument("--count", type=int, default=300)
    parser.add_argument("--seed", default="0")
    chosen = parser.parse_args()
    with tempfile.TemporaryDirectory() as where:
        numbers, wrong = campaign(chosen.count, chosen.seed, Path(where))
    print("\n".join(wrong), dict(numbers), sep="\n")
    sys.exit(bool(wrong))
