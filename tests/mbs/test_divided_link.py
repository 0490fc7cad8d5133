"""Modal coordinates of a link in those of its pieces: turns of sections, strain energy, and back."""

from pathlib import Path

import numpy as np
import pytest
from beam_links import beam_link

from ffrobot.fe_models.link import cached_modal_body
from ffrobot.fe_models.link_source import LinkTable
from ffrobot.fe_models.pieces import cut
from ffrobot.mbs.model.body import from_modal_body
from ffrobot.mbs.model.divided_link import PieceOfLink, divided_link_of
from ffrobot.mbs.model.projection import projected

MODES = 4


def planar(name, modal):
    return projected(from_modal_body(name, modal, is_planar=True))


def divided(condition, count, modes=MODES):
    """A link, its pieces, and its modes in theirs."""
    section = {"shape": "rectangle", "height": 0.01, "width": 0.02}
    keys = beam_link(
        0.8,
        section,
        24,
        nu=0.3,
        condition=condition,
        name="link",
        modes={"count": modes, "family": "in-plane-bending", "attachment_modes": False},
    )
    source = LinkTable(keys, Path("link.toml"))
    link, parts = cached_modal_body(source).body, cut(source, count)
    pieces = [
        PieceOfLink(start, modal, planar(f"piece {k}", modal))
        for k, (start, modal) in enumerate(
            (start, cached_modal_body(table).body) for start, table in zip(parts.starts, parts.tables, strict=True)
        )
    ]
    whole = planar("link", link)
    return link, whole, pieces, divided_link_of(link, whole, pieces)


@pytest.mark.parametrize("condition", ["cantilever", "simply-supported"])
@pytest.mark.parametrize("count", [2, 4, 8])
def test_sections_turn_from_cut_to_cut_as_those_of_the_link(condition, count):
    link, whole, pieces, found = divided(condition, count)
    rows = np.cumsum([0, *(piece.spatial.n_modes for piece in pieces)])
    largest = np.abs(link.stations.rotation[:, 2] @ whole.modal_transform).max(axis=0)
    for piece, first, last in zip(pieces, rows[:-1], rows[1:], strict=True):
        ends = piece.start, piece.start + piece.modal.length
        a, b = (link.interpolate(min(x, link.length)).rotation[2] @ whole.modal_transform for x in ends)
        start, end = (piece.spatial.points[name].rotation[2] for name in ("root", "tip"))
        np.testing.assert_allclose((end - start) @ found.spread[first:last], b - a, atol=2e-4 * largest.max())


@pytest.mark.parametrize("count", [4, 8])
def test_strain_energy_converges_from_below(count):
    """What the shapes of the pieces do not have of the link's modes is left out: the more pieces, the less."""
    _, whole, pieces, found = divided("cantilever", count)
    stiffness = np.concatenate([piece.spatial.stiffness for piece in pieces])
    part = np.einsum("kn,k,kn->n", found.spread, stiffness, found.spread) / whole.stiffness
    assert (part < 1 + 1e-4).all()  # strains are taken as constant over a 32nd of a piece
    assert (part > 1 - {4: 0.06, 8: 0.004}[count]).all()
    assert part[0] == pytest.approx(1.0, abs=1e-4)
