"""What a solve prints of modes that it chose, and of links in pieces."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

from ..mbs.model.body import Body
from ..mbs.model.truncation import modes_kept
from ..run.mode_search import ModeChoice
from ..scene.pieces import BodyInPieces


def chosen_modes(bodies: Sequence[Body], choice: ModeChoice) -> str:
    """How many modes were enough, and what leaving out the others costs and saves."""
    kept = [f"{body.name}: {modes_kept(body)}" for body in bodies if body.n_modes]
    lines = ["; ".join(kept)]
    for name, errors in choice.errors.items():
        if any(errors.values()):
            found = ", ".join(f"{kind} {error:.0e}" for kind, error in errors.items() if error)
            lines.append(f"{name}: error of leaving out the others, estimated: {found}")
        else:
            lines.append(
                f"{name}: with fewer ({choice.tried[-2]}) results differ by {max(choice.before[name].values()):.0e}"
            )
    tried = ", ".join(map(str, choice.tried))
    fewer = {body.name: body.reduction.lowest for body in bodies if body.reduction is not None}
    if fewer:
        keys = ", ".join(f"modes = {lowest} for {name}" for name, lowest in fewer.items())
        lines.append(f"the same without search: {keys}")
    lines.append(
        f"solved with {tried} modal coordinates, {choice.seconds:.2f} s before the last; the highest frequency is"
        f" {choice.highest[0]:.3g} of {choice.highest[1]:.3g} rad/s"
    )
    return "\n".join(lines)


def pieces_in_words(divided: Mapping[str, BodyInPieces]) -> str:
    """How many of each link."""
    return ", ".join(f"{name}: {len(body.names)}" for name, body in divided.items())
