"""Counts of private words, long sentences and history in what users read: `python docs/language.py` writes them.

`docs/vocabulary.txt` lists the words. Counts per file are in `docs/language.csv`; a test lets them fall, not rise.
"""

from __future__ import annotations

import ast
import csv
import inspect
import re
import sys
from collections.abc import Iterator
from pathlib import Path
from typing import NamedTuple

import click

ROOT = Path(__file__).parents[1]
VOCABULARY, COUNTS = ROOT / "docs" / "vocabulary.txt", ROOT / "docs" / "language.csv"
PACKAGES = ("common", "mesh", "fe_models", "mbs", "actuation", "ffrobot")
LONG = 35  # words of a sentence
HISTORY = re.compile(
    r"\b(no longer|used to (?=be|have|take|do)|formerly|now also|until now|in the past)", re.IGNORECASE
)

FENCE = re.compile(r"^ *(```|~~~).*?^ *\1 *$", re.DOTALL | re.MULTILINE)
INDENTED = re.compile(r"(?:(?<=\n\n)|\A)(?:(?: {4}|\t).*\n?|\n(?= {4}))+")
EXEMPT = re.compile(r"``[^`]+``|`[^`]*`|\$\$.*?\$\$|\$[^$\n]+\$|<[^>\n]+>|https?://\S+", re.DOTALL)
EXAMPLES = re.compile(r"^\x08\n(?:.+\n?)+", re.MULTILINE)  # paragraphs that click prints line by line
TABLE = re.compile(r"^ *\|.*$|^#+ .*$", re.MULTILINE)  # and headings: no sentences
LINK = re.compile(r"!?\[((?:[^\[\]]|\[[^\[\]]*\])*)\]\([^)]*\)")
SENTENCE = re.compile(r"(?<=[.!?])\s+|:\s*\n|\n\s*(?:[*+-]|\d+\.|#+|>)\s+|\n\s*\n|\s*\|\s*")
WORD = re.compile(r"\w*[^\W\d_]\w*(?:[-'’]\w+)*")


class Count(NamedTuple):
    """What was counted in one file."""

    private: int
    history: int
    sentences: int
    long: int

    @property
    def findings(self) -> tuple[int, int, int]:
        """What the ratchet bounds."""
        return self.private, self.history, self.long


def vocabulary() -> list[tuple[re.Pattern[str], str]]:
    """The private expressions and their replacements."""
    lines = [line for line in VOCABULARY.read_text(encoding="utf-8").splitlines() if line and not line.startswith("#")]
    pairs = [re.split(r" {2,}", line, maxsplit=1) for line in lines]
    return [(re.compile(rf"\b(?:{private})\b", re.IGNORECASE), plain) for private, plain in pairs]


def prose(text: str) -> str:
    """A Markdown page without code, formulas and addresses."""
    return LINK.sub(r"\1", EXEMPT.sub(" X ", INDENTED.sub("\n", FENCE.sub("\n\n", text))))


def length(sentence: str) -> int:
    """The number of words."""
    return len(WORD.findall(sentence))


def sentences(text: str) -> Iterator[str]:
    """The sentences of prose; a list item, a heading or a cell of a table counts as one."""
    yield from (" ".join(part.split()) for part in SENTENCE.split(text) if part and length(part) > 3)


def running(text: str) -> str:
    """Prose without tables and headings."""
    return TABLE.sub("", text)


def found(text: str) -> Iterator[tuple[str, str]]:
    """The private expressions in prose, with what to write instead."""
    flat = " ".join(text.split())
    for pattern, plain in vocabulary():
        yield from ((match[0], plain) for match in pattern.finditer(flat))


def count(text: str) -> Count:
    """Counts of one page of prose; sentences are those of its running text."""
    lengths = [length(sentence) for sentence in sentences(running(text))]
    history = len(HISTORY.findall(" ".join(text.split())))
    return Count(sum(1 for _ in found(text)), history, len(lengths), sum(words > LONG for words in lengths))


def texts(root: Path = ROOT) -> dict[str, str]:
    """The prose of all pages by file, texts in figures, and what `--help` prints."""
    pages = [
        root / "README.md",
        root / "CONTRIBUTING.md",
        *sorted((root / "docs").rglob("*.md")),
        *sorted((root / "cases").glob("*/README.md")),
    ]
    named = {
        str(page.relative_to(root)): page.read_text(encoding="utf-8") for page in pages if "_build" not in page.parts
    }
    printed = {f"printed by {package}": printed_texts(root / package) for package in PACKAGES}
    drawn = {str(path.relative_to(root)): figure_texts(path) for path in root.glob("cases/*/figures*.toml")}
    return {name: prose(text) for name, text in named.items()} | printed | drawn | {"ffrobot --help": help_texts()}


def help_texts() -> str:
    """Help of the commands and of their options: those of key files are in docs/reference."""
    from ffrobot.cli import cli

    parts = [cli.help or ""]
    for command in cli.commands.values():
        parts += [inspect.cleandoc(text) for text in (command.help, command.epilog) if text]
        parts += [option.help or "" for option in command.params if isinstance(option, click.Option)]
    return prose("\n\n".join(EXAMPLES.sub("", part) for part in parts))


def figure_texts(path: Path) -> str:
    """Titles and labels in a figures file of a case."""
    return "\n\n".join(re.findall(r'\b(?:\w*title|\w*label) = "([^"]*)"', path.read_text(encoding="utf-8")))


def printed_texts(package: Path) -> str:
    """Strings of more than two words in the code of a package, without docstrings: messages, titles, notes."""
    return prose("\n\n".join(text for file in sorted(package.rglob("*.py")) for text in _strings(file)))


def _strings(file: Path) -> Iterator[str]:
    """Texts of one file: an f-string is one text, its values are exempt."""
    tree = ast.parse(file.read_text(encoding="utf-8"))
    nodes = list(ast.walk(tree))
    apart = {
        id(part) for node in nodes if isinstance(node, ast.JoinedStr) for part in ast.walk(node) if part is not node
    }
    apart |= {id(node.value) for node in nodes if isinstance(node, ast.Expr)}  # docstrings
    for node in nodes:
        if id(node) in apart:
            continue
        if isinstance(node, ast.JoinedStr):
            yield "".join(str(part.value) if isinstance(part, ast.Constant) else "`value`" for part in node.values)
        elif isinstance(node, ast.Constant) and isinstance(node.value, str) and node.value.count(" ") > 1:
            yield node.value


def read_counts() -> dict[str, tuple[int, ...]]:
    """The committed counts by file: private, history, long."""
    with COUNTS.open(encoding="utf-8", newline="") as file:
        return {name: tuple(map(int, counts)) for name, *counts in list(csv.reader(file))[1:]}


def write_counts() -> None:
    """Write `docs/language.csv` anew: files that have any."""
    counts = {name: count(text) for name, text in sorted(texts().items())}
    with COUNTS.open("w", encoding="utf-8", newline="") as file:
        writer = csv.writer(file, lineterminator="\n")
        writer.writerow(["file", "private", "history", "long"])
        writer.writerows([name, *one.findings] for name, one in counts.items() if any(one.findings))


def show(name: str) -> None:
    """Print where a page has private words, history and long sentences."""
    text = texts()[name]
    counted = set(sentences(running(text)))
    for sentence in sentences(text):
        words = [f"{private!r} → {plain}" for private, plain in found(sentence)]
        words += [f"{length(sentence)} words"] if length(sentence) > LONG and sentence in counted else []
        words += [f"{match[0]!r} → history" for match in HISTORY.finditer(sentence)]
        if words:
            print(f"{name}: {sentence}\n    {'; '.join(words)}")


if __name__ == "__main__":
    if sys.argv[1:]:
        for name in sys.argv[1:]:
            show(name)
    else:
        write_counts()
