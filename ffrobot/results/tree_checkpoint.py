"""Where a run in joint coordinates has stopped, in results files: of scenes in the plane and in space."""

from __future__ import annotations

from typing import Any

import h5py

from ..common.errors import InputError
from ..mbs import _core
from ..mbs.analysis.outcome import METHOD_HISTORY, STEPS, TREE_MEMORY, TREE_VECTORS
from .file import Results
from .stopped import row_of_numbers


def write_tree_checkpoint(group: h5py.Group, checkpoint: _core.TreeCheckpoint) -> None:
    """Add "checkpoint" to what is kept of an analysis."""
    for name in TREE_VECTORS:
        group[f"checkpoint/{name}"] = getattr(checkpoint, name)
    about = {name: getattr(checkpoint, name) for name in ("time", "outputs", *TREE_MEMORY)}
    about |= {name: getattr(checkpoint.steps, name) for name in STEPS}
    about |= {name: getattr(checkpoint.methods, name) for name in METHOD_HISTORY}
    group["checkpoint"].attrs.update(about)


def read_tree_checkpoint(file: Results, group: str) -> _core.TreeCheckpoint:
    """That of a group. Raises `InputError` where it lacks something."""
    about = file.attributes(group)
    try:
        memory: dict[str, Any] = {name: about[name].item() for name in TREE_MEMORY}
        memory |= {name: row_of_numbers(file, f"{group}/{name}") for name in TREE_VECTORS}
        found: _core.TreeCheckpoint = _core.TreeCheckpoint(
            time=float(about["time"]),
            outputs=int(about["outputs"]),
            steps=_core.StepHistory(**{name: about[name].item() for name in STEPS if name in about}),
            methods=_core.MethodHistory(**{name: about[name].item() for name in METHOD_HISTORY}),
            **memory,
        )
        return found
    except (TypeError, ValueError, KeyError, AttributeError) as error:
        raise InputError(f"{file.path}: {group}: expected where the run has stopped, found {error}") from None
