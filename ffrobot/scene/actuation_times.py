"""When forward analyses end that do not say it: with the analysis whose actuation they take."""

from __future__ import annotations

from typing import Any


def with_times_of_actuation(data: dict[str, Any]) -> dict[str, Any]:
    """`data` with the `end` and `output_step` of forward analyses taken from their actuation where not given."""
    try:
        sources = {analysis["name"]: analysis for analysis in data["analysis"]}
        analyses = []
        for analysis in data["analysis"]:
            source = sources.get(analysis.get("actuation"), {})
            times = {key: source[key] for key in ("end", "output_step") if key in source}
            analyses.append(times | analysis)
    except (KeyError, TypeError, AttributeError):
        return data  # malformed: validation says how
    return data | {"analysis": analyses}
