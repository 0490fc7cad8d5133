"""The posture that a run starts from, where the scene leaves the choice to the program."""

from __future__ import annotations

import numpy as np

from ..mbs.model.model import Model
from ..mbs.solve.branch_names import branch_names, in_words
from ..mbs.solve.start import undeformed_posture
from ..results.file import Results

UNITS = {"revolute": ("°", 180 / np.pi), "prismatic": (" m", 1.0)}


def chosen_posture(results: Results, model: Model) -> str:
    """Joints and branch at the start of a run, where a point follows a path and nothing says which posture; else ""."""
    scene = results.scene
    initial = scene.get("initial", {})
    named = any(initial.get(key) for key in ("angles", "joints", "branch"))
    if named or not any("point" in one for one in scene.get("trajectory", ())):
        return ""
    for analysis in results.analyses:
        found = [
            f"{joint['name']} {round(results[name].ravel()[0] * factor, 6) + 0.0:.4g}{unit}"
            for joint in scene.get("joint", ())
            if results.has(name := f"{analysis}/joints/{joint['name']}/coordinate") and len(results[name])
            for unit, factor in [UNITS.get(joint["type"], (None, 1.0))]
            if unit is not None
        ]
        if found:
            branch = branch_names(model, undeformed_posture(model).q)
            as_line = f" ({in_words(branch)})" if branch else ""
            return (
                f"no guess in [initial]: {analysis} starts at {', '.join(found)}{as_line}, found from zeros; where"
                " another posture reaches the path as well (elbow up or down), [initial] chooses"
            )
    return ""
