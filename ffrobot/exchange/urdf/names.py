"""Names of other programs as scenes may have them."""

from __future__ import annotations

from collections.abc import Iterable

from ...common.keys import LONGEST_NAME

FORBIDDEN = str.maketrans({"/": "_", ".": "_"})


class Names:
    """Names in one list, each once: the same for the same original, with the fewest changes that the rules ask for.

    Attributes:
        changed: originals whose name is another one now.
    """

    def __init__(self, taken: Iterable[str] = ()) -> None:
        self._taken = set(taken)
        self._of = dict[str, str]()

    def __getitem__(self, original: str) -> str:
        if original not in self._of:
            self._of[original] = self._free(_allowed(original))
        return self._of[original]

    @property
    def changed(self) -> dict[str, str]:
        """The new name of each original that could not stay."""
        return {original: name for original, name in self._of.items() if original != name}

    def _free(self, name: str) -> str:
        candidate, number = name, 2
        while candidate in self._taken:
            candidate, number = f"{name}_{number}", number + 1
        self._taken.add(candidate)
        return candidate


def _allowed(name: str) -> str:
    """Without what `common.keys.check_name` refuses."""
    printable = "".join(c if c.isprintable() else "_" for c in name.translate(FORBIDDEN)).strip()
    return printable[: LONGEST_NAME - 4] if len(printable) > LONGEST_NAME else printable or "_"
