"""Sphinx configuration: Markdown pages; commands, Python interface and keys of files from the program."""

from __future__ import annotations

import sys
from pathlib import Path
from typing import Any

import ffrobot

sys.path.insert(0, str(Path(__file__).parent))

from benchmark_tables import write_benchmark_tables
from gallery import read_on_site, write_case_pages
from interfaces import write_interface_pages
from key_tables import write_key_tables
from notebook import write_notebook_page

project = "ffrobot"
author = "the ffrobot developers"
version = release = ffrobot.__version__
# Formulas are set by a MathJax that is part of the site: pages open without a network.
extensions = ["myst_parser", "sphinx.ext.mathjax", "sphinx-mathjax-offline"]
myst_enable_extensions = ["dollarmath"]
myst_heading_anchors = 3
html_theme = "furo"
html_static_path = ["_static"]
html_css_files = ["gallery.css"]
html_title = f"ffrobot {version}"
exclude_patterns = ["_build"]


def setup(app: Any) -> None:
    """Write the pages that are generated, before Sphinx looks for pages."""
    app.connect("builder-inited", lambda app: _write_pages(Path(app.srcdir)))
    app.connect("source-read", _read)


def _write_pages(folder: Path) -> None:
    write_key_tables(folder / "reference")
    write_interface_pages(folder / "reference")
    write_case_pages(folder / "cases")
    write_notebook_page(folder)
    write_benchmark_tables(folder / "benchmarks", folder / "developer" / "benchmark_records.md")


def _read(app: Any, name: str, source: list[str]) -> None:
    source[0] = read_on_site(name, source[0])
