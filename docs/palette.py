"""Pictures of pages with a palette, a third of their size: `python docs/palette.py` for PNG files of docs and cases."""

from __future__ import annotations

import io
from pathlib import Path

import numpy as np
from PIL import Image

ROOT = Path(__file__).parents[1]
COLORS = 256
WIDEST = 960  # pixels of a picture on a page
SAME = 4.0  # of 255, mean difference of two pictures: less is that of fonts and palettes


def reduced(path: Path, widest: int | None = None) -> bytes:
    """The picture at `path` as PNG with a palette, at most `widest` pixels wide."""
    with Image.open(path) as picture:
        whole = picture.convert("RGBA")
    page = Image.alpha_composite(Image.new("RGBA", whole.size, "white"), whole).convert("RGB")
    if widest and page.width > widest:
        page = page.resize((widest, round(page.height * widest / page.width)), Image.Resampling.LANCZOS)
    content = io.BytesIO()
    page.quantize(COLORS, Image.Quantize.MAXCOVERAGE, dither=Image.Dither.NONE).save(content, "PNG", optimize=True)
    return content.getvalue()


def difference(first: bytes, second: bytes) -> float:
    """The mean of what two pictures differ by, of 255; infinite if their sizes do."""
    one, other = (
        np.asarray(Image.open(io.BytesIO(content)).convert("RGB"), dtype=float) for content in (first, second)
    )
    return float(np.abs(one - other).mean()) if one.shape == other.shape else np.inf


def pictures() -> list[Path]:
    """PNG files of pages and cases."""
    return [
        path
        for folder in ("docs", "cases")
        for path in sorted((ROOT / folder).rglob("*.png"))
        if "_build" not in path.parts
    ]


if __name__ == "__main__":
    for path in pictures():
        with Image.open(path) as picture:
            has_palette = picture.mode == "P"
        if not has_palette and len(content := reduced(path)) < path.stat().st_size:
            path.write_bytes(content)
