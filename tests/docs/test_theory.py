"""The theory page: equations are numbered in order, references have one, the script draws all figures."""

import re
import sys
from pathlib import Path

import pytest

DOCS = Path(__file__).parents[2] / "docs"
PAGE = (DOCS / "theory.md").read_text(encoding="utf-8")

sys.path.insert(0, str(DOCS))


def test_equations_are_numbered_in_order():
    numbers = [int(tag) for tag in re.findall(r"\\tag\{(\d+)\}", PAGE)]
    assert numbers == list(range(1, len(numbers) + 1))
    assert len(numbers) == len(re.findall(r"\$\$.+?\$\$", PAGE, re.DOTALL))


def test_references_are_to_equations_of_the_page():
    last = len(re.findall(r"\\tag\{\d+\}", PAGE))
    prose = re.sub(r"\$\$.+?\$\$|\$[^$]+\$|\([^()]*\d{4}[^()]*\)", "", PAGE, flags=re.DOTALL)
    referred = [int(number) for number in re.findall(r"\((\d{1,2})\)", prose)]
    assert len(referred) > 20
    assert max(referred) <= last


def test_formulas_of_several_lines_keep_their_number_on_the_site():
    r"""Sphinx wraps a formula with \\ in an environment that allows no \tag."""
    assert not [formula for formula in re.findall(r"\$\$.+?\$\$", PAGE, re.DOTALL) if r"\\" in formula]


def test_figures_of_the_page_are_those_that_the_script_draws(tmp_path):
    pytest.importorskip("matplotlib")
    from sketches import draw_all

    draw_all(tmp_path)
    drawn = {path.name for path in tmp_path.glob("theory/*.svg")}
    assert drawn == set(re.findall(r"\(theory/(\w+\.svg)\)", PAGE)) == {path.name for path in DOCS.glob("theory/*.svg")}
    assert len(drawn) == 4
