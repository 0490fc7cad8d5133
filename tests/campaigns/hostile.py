"""Hostile values, and changes of TOML data and text with them, drawn from a seed."""

import copy
import random
import re
from collections.abc import Iterator
from datetime import date
from typing import Any

NAMES = [
    "", " ", ".", "..", "a/b", "a.b", "$x", "$\\bad{$", "a_b^c", "\\", "<b>x</b>", "</script>", "&amp;", "{{ 7*7 }}",
    "[red]x[/]", "%s%n", "line\nbreak", "tab\there", "nul\0", "\x1b[31m", "größe", "関節", "🤖", "e\u0301", "\u202e",
    "ground", "mid", "root", "CON", "-o", "~", "'\"", "a" * 300, "x" * 100_000, "time", "resume",
]  # fmt: skip
NUMBERS = [
    0, -1, 1, 2, 3, 1.5, -0.0, 1e-320, 1e-300, 1e-30, 1e-12, 1e12, 1e30, 1e300, -1e300, 10**9, 10**18, -(10**18),
    2**31, 2**32, 2**63, 10**24, 10**400, float("nan"), float("inf"), float("-inf"),
]  # fmt: skip
OTHERS = [
    True, False, [], {}, [[]], [{}], [1, 2], [1.0, 2.0, 3.0], ["a"], {"a": 1}, [0.0] * 5000, ["0"] * 300,
    [1, "a", True, []], date(2020, 1, 1),
]  # fmt: skip
EXPRESSIONS = [
    "t", "0", "1/0", "1/t", "log(-1)", "exp(exp(20*t))", "where(t > 0.005, 1, 0)", "abs(t-0.005)", "sqrt(0.005-t)",
    "9**9**9", "(" * 300, "__import__('os')", "t" + "+t" * 5000, "1e308*10", "tan(1e9*t)", "0.1*sin(1e6*t)", "π",
    "lambda: 0", "2 t", "t**0.5",
]  # fmt: skip
FILES = [
    "", "/", "/dev/null", "/dev/zero", "nowhere.toml", "scene.toml", "link1.toml", "../x.toml", "a" * 5000,
    "nul\0.toml", "loop", "figures",
]  # fmt: skip


def places(data: Any, here: tuple[int | str, ...] = ()) -> Iterator[tuple[int | str, ...]]:
    """Every key, every table of a list and the first of other entries, and the file as a whole as ()."""
    yield here
    if isinstance(data, list) and data and not isinstance(data[0], dict | list):
        yield (*here, 0)
        return
    for key, value in data.items() if isinstance(data, dict) else enumerate(data):
        if isinstance(value, dict | list):
            yield from places(value, (*here, key))
        else:
            yield (*here, key)


def known_keys(data: Any) -> Iterator[str]:
    for key, value in data.items() if isinstance(data, dict) else enumerate(data):
        if isinstance(key, str):
            yield key
        if isinstance(value, dict | list):
            yield from known_keys(value)


class Mutator:
    """Changes drawn from a seed."""

    def __init__(self, chance: random.Random, keys: list[str]) -> None:
        self.chance, self.keys = chance, keys

    def value(self, old: object) -> Any:
        kind = self.chance.random()
        if isinstance(old, int | float) and not isinstance(old, bool) and kind < 0.75:
            return self.number(old)
        if isinstance(old, str) and kind < 0.7:
            return self.text()
        if kind > 0.95:
            return self.nested(self.chance.choice([10, 50, 150, 400]))
        return copy.deepcopy(self.chance.choice([*NUMBERS, *OTHERS, *NAMES, *EXPRESSIONS]))

    def number(self, old: float) -> float:
        if self.chance.random() < 0.4:
            return old * 10.0 ** self.chance.uniform(-3, 3)
        return self.chance.choice([
            -old, old * 10.0 ** self.chance.randint(-40, 40), old * 10.0 ** self.chance.uniform(-4, 4),
            self.chance.choice(NUMBERS), int(old) if abs(old) < 1e300 else 0,
        ])  # fmt: skip

    def text(self) -> str:
        return self.chance.choice(self.chance.choice([NAMES, NAMES, EXPRESSIONS, FILES, self.keys]))

    def nested(self, depth: int) -> Any:
        value: Any = 1
        for _ in range(depth):
            value = [value] if self.chance.random() < 0.5 else {"a": value}
        return value

    def mutate(self, data: dict[str, Any], place: tuple[int | str, ...]) -> str:
        """Change `data` at `place`; says how."""
        if not place:
            key = self.chance.choice([*self.keys, *NAMES])
            data[key] = self.value(self.chance.choice(["text", 1.0]))
            return f"{key[:40]!r} = {str(data[key])[:60]!r} added"
        *way, last = place
        inner: Any = data
        for part in way:
            inner = inner[part]
        where = ".".join(map(str, place))
        how = self.chance.random()
        if how < 0.12:
            del inner[last]
            return f"{where} removed"
        if how < 0.2 and isinstance(inner, list):
            inner.append(copy.deepcopy(inner[last]))
            return f"{where} doubled"
        if how < 0.3 and isinstance(inner, dict):
            key = self.chance.choice([*self.keys, *NAMES])
            inner[key] = self.value(self.chance.choice(["text", 1.0]))
            return f"{where}: {key[:40]!r} = {str(inner[key])[:60]!r} added beside it"
        inner[last] = self.value(inner[last])
        return f"{where} = {str(inner[last])[:80]!r}"

    def damage(self, text: str) -> tuple[bytes, str]:
        """The text of a file, damaged."""
        raw = text.encode()
        cut = self.chance.randrange(len(raw))
        lines = text.splitlines(keepends=True)
        doubled = self.chance.randrange(len(lines))
        kinds = {
            "byte order mark": b"\xef\xbb\xbf" + raw,
            "byte order mark of UTF-16": text.encode("utf-16"),
            "byte that is no UTF-8": raw[:cut] + b"\xff" + raw[cut:],
            "cut off": raw[:cut],
            "NUL": raw[:cut] + b"\0" + raw[cut:],
            "empty": b"",
            "deep list": raw + b"\nx = " + b"[" * 3000 + b"]" * 3000,
            "deep table": raw + b"\nx = " + b"{a=" * 2000 + b"1" + b"}" * 2000,
            "deep key": raw + b"\n" + b".".join([b"a"] * 3000) + b" = 1",
            "long integer": re.sub(rb"= \d[\d.e+-]*", b"= " + b"1" * 5000, raw, count=1),
            "line doubled": "".join([*lines[:doubled], lines[doubled], *lines[doubled:]]).encode(),
            "line removed": "".join([*lines[:doubled], *lines[doubled + 1 :]]).encode(),
            "CRLF": raw.replace(b"\n", b"\r\n"),
        }
        name = self.chance.choice(list(kinds))
        return kinds[name], name


class Damage:
    """Changes of a file's bytes, drawn from a seed."""

    def __init__(self, chance: random.Random, script: bytes) -> None:
        self.chance, self.script, self.mutator = chance, script, Mutator(chance, ["NODE"])

    def of(self, content: bytes) -> tuple[bytes, str]:
        kind = self.chance.choice(["token", "token", "token", "line", "line", "cut out", "bits", "text", "script"])
        at = self.chance.randrange(len(content))
        if kind == "cut out":
            return content[:at] + content[at + self.chance.randrange(1, 2000) :], f"a part cut out at {at}"
        if kind == "bits":
            changed = bytearray(content)
            for _ in range(self.chance.choice([1, 1, 4, 40])):
                changed[self.chance.randrange(len(changed))] ^= 1 << self.chance.randrange(8)
            return bytes(changed), "bits turned"
        if kind == "script":
            at = self.chance.choice([0, 0, content.find(b"\n", at) + 1])
            return content[:at] + self.script + content[at:], f"a script at {at}"
        if kind == "text":
            try:
                return self.mutator.damage(content.decode())
            except UnicodeDecodeError:
                return content[:at], "cut off"
        lines = content.split(b"\n")
        k = self.chance.randrange(len(lines))
        if kind == "line":
            how = self.chance.choice(["removed", "doubled", "moved"])
            line = lines.pop(k)
            for _ in range({"removed": 0, "doubled": 2, "moved": 1}[how]):
                lines.insert(k if how == "doubled" else self.chance.randrange(len(lines) + 1), line)
            return b"\n".join(lines), f"line {k + 1} {how}: {line[:60]!r}"
        return self._token(lines, k)

    def _token(self, lines: list[bytes], k: int) -> tuple[bytes, str]:
        pieces = [piece for piece in lines[k].replace(b",", b" ").split() if piece.strip()]
        if not pieces:
            return b"\n".join(lines), "nothing"
        old = self.chance.choice(pieces)
        new = str(self.chance.choice([*NUMBERS, *NAMES[:20], "", "*", "1,2", "2147483648", "-1", "1e5", "7"])).encode()
        lines[k] = lines[k].replace(old, new, 1)
        return b"\n".join(lines), f"line {k + 1}: {old[:30]!r} → {new[:30]!r}"
