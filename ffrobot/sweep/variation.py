"""What a sweep varies: `KEY=VALUES` from the command line, and the grid or sample made of several of them."""

from __future__ import annotations

import math
import tomllib
from collections.abc import Sequence
from dataclasses import dataclass
from itertools import product
from typing import Any, TypeAlias

import numpy as np

from ..common.errors import InputError
from ..common.keys import MOST_RUNS
from ..common.tables import DEEPEST, shown

Value: TypeAlias = Any
"""What TOML may hold: a number, a text, a list …"""


@dataclass(frozen=True)
class Variation:
    """A key of the scene, or of a link file (`links.BODY.…`), or several alike, and the values taken.

    Attributes:
        keys: parts of each key, `("links", "link1", "geometry", "section", "height")`.
        values: the values, in order.
        ends: first and last value of a range, from which a sample draws; None where values are listed.
        logarithmic: whether a range is even in the logarithm.
    """

    keys: tuple[tuple[str, ...], ...]
    values: tuple[Value, ...]
    ends: tuple[float, float] | None = None
    logarithmic: bool = False

    @property
    def name(self) -> str:
        """The keys as the user writes them."""
        return ",".join(".".join(key) for key in self.keys)

    def draw(self, u: float) -> Value:
        """The value at u in [0, 1) of the range, or of the list."""
        if self.ends is None:
            return self.values[int(u * len(self.values))]
        a, b = self.ends
        return float(a * (b / a) ** u) if self.logarithmic else float(a + u * (b - a))


def parse_variation(text: str) -> Variation:
    """`key=0.01:0.03:9` (evenly spaced), `key=1e-6:1e-3:4:log`, or `key=0.1,0.2` and `key="static","undeformed"`.

    `key,key=…` sets both to the same value.
    Raises `InputError` where it is none of these.
    """
    key, equals, values = text.partition("=")
    keys = tuple(tuple(one.strip().split(".")) for one in key.split(","))
    text = shown(text)
    if not equals or not all(map(all, keys)) or max(map(len, keys)) > DEEPEST:
        raise InputError(f'--vary: expected KEY=VALUES, such as gravity.1=-9.81:0:5, found "{text}"')
    pieces = values.split(":")
    if len(pieces) in (3, 4) and '"' not in values:
        return _range(keys, pieces, text)
    try:
        listed = tomllib.loads(f"values = [{values}]")["values"]
    except (ValueError, RecursionError):  # no TOML, a number of thousands of digits, lists in lists without end
        listed = []
    if not listed:
        raise InputError(
            "--vary: expected FIRST:LAST:COUNT, FIRST:LAST:COUNT:log or a list with commas (texts in quotes), found"
            f' "{text}"'
        )
    return Variation(keys, tuple(listed))


def _range(keys: tuple[tuple[str, ...], ...], pieces: Sequence[str], text: str) -> Variation:
    logarithmic = len(pieces) == 4
    try:
        first, last, count = float(pieces[0]), float(pieces[1]), int(pieces[2])
    except ValueError:
        raise InputError(f'--vary: expected two numbers and a count, FIRST:LAST:COUNT, found "{text}"') from None
    if count < 1 or not np.isfinite([first, last]).all() or (logarithmic and pieces[3] != "log"):
        raise InputError(f'--vary: expected FIRST:LAST:COUNT with a count of at least 1, or …:log, found "{text}"')
    if count > MOST_RUNS:
        raise InputError(f'--vary: expected at most {MOST_RUNS} values, found "{text}"')
    if logarithmic and not np.sign(first) * np.sign(last) > 0:
        raise InputError(f'--vary: expected two ends of one sign for a logarithmic range, found "{text}"')
    spaced = np.geomspace(first, last, count) if logarithmic else np.linspace(first, last, count)
    return Variation(keys, tuple(float(value) for value in spaced), (first, last), logarithmic)


def grid(variations: Sequence[Variation]) -> list[tuple[Value, ...]]:
    """Every combination of the values; the last key varies fastest. Raises `InputError` where these are too many."""
    if (count := math.prod(len(variation.values) for variation in variations)) > MOST_RUNS:
        raise InputError(f"--vary: expected at most {MOST_RUNS} runs, found {count}: --sample takes some of them")
    return list(product(*(variation.values for variation in variations)))


def latin_hypercube(variations: Sequence[Variation], count: int, seed: int) -> list[tuple[Value, ...]]:
    """`count` combinations of which each key's values spread evenly over its range (McKay, Beckman & Conover 1979)."""
    from scipy.stats.qmc import LatinHypercube

    sample = LatinHypercube(len(variations), seed=seed).random(count)
    return [tuple(v.draw(float(u)) for v, u in zip(variations, row, strict=True)) for row in sample]
