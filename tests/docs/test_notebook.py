"""The notebook of the first hour runs, and shows what it prints and draws now."""

import base64
import copy
import sys
from pathlib import Path

import pytest

sys.path.insert(0, str(Path(__file__).parents[2] / "docs"))

from notebook import NOTEBOOK, PNG, read_notebook, run_notebook
from palette import SAME, difference


@pytest.mark.nightly
def test_notebook_shows_what_its_cells_do(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    shown = read_notebook()
    for before, now in zip(shown["cells"], run_notebook(copy.deepcopy(shown))["cells"], strict=True):
        for old, new in zip(before.get("outputs", []), now.get("outputs", []), strict=True):
            assert old.get("text") == new.get("text"), f"run python docs/notebook.py ({NOTEBOOK})"
            if "data" in old:
                pictures = (base64.b64decode(output["data"][PNG]) for output in (old, new))
                assert difference(*pictures) < SAME, f"run python docs/notebook.py ({NOTEBOOK})"
