"""Lines of summaries, of plane and space."""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Mapping

from ..mbs.solve.integrators import Choice


def alike(lines: Iterable[tuple[str, str]]) -> Iterator[str]:
    """What is said of several analyses, once for all of them."""
    names: dict[str, list[str]] = {}
    for name, text in lines:
        names.setdefault(text, []).append(name)
    for text, of in names.items():
        yield f"{', '.join(of)}: {text}"


def integrator_lines(choices: Mapping[str, Choice]) -> Iterator[str]:
    """By analysis: which integrators the program has chosen, and why."""
    return alike((name, f"{one.name}; {one.reason}") for name, one in choices.items() if one.is_automatic)
