"""Where patches were placed on a link, over what one patch would reach of each mode."""

from __future__ import annotations

from matplotlib.axes import Axes

from ...common.errors import InputError
from ...results.file import Results
from .figure_file import FigureRecord
from .palette import COLORS
from .style import legend, shades


def draw_placement(axes: Axes, figure: FigureRecord, results: Results) -> None:
    """Reach of a single patch along the link by mode; below, the patches found and those spread evenly."""
    group = f"{figure.analysis}/placement"
    if not results.has(group):
        raise InputError(
            f'{results.path}: figure "{figure.name}": expected an analysis of kind = "placement", found'
            f' "{figure.analysis}"'
        )
    body = results.attributes(group)["body"]
    length = next(layout["length"] for layout in results.scene["pzt"] if layout["body"] == body)
    centers, frequency = results[f"{group}/candidates"], results[f"{group}/frequency"]
    for reach, f, color in zip(results[f"{group}/candidate_reach"], frequency, shades(len(frequency)), strict=True):
        axes.plot(centers, reach, color=color, label=f"{f:.4g} Hz")
    for k, (key, label) in enumerate((("best", "found"), ("even", "evenly spaced"))):
        places = [(x - length / 2, length) for x in results[f"{group}/{key}/centers"]]
        axes.broken_barh(places, (-0.12 * (k + 1), 0.08), color=COLORS[k], label=label)
    axes.set_yticks([0.0, 0.25, 0.5, 0.75, 1.0])
    axes.set_xlabel(f"distance along {body} (m)")
    axes.set_ylabel("controllability by one patch")
    legend(axes)
