"""The notebook docs/first_hour.ipynb: `python docs/notebook.py` runs it and keeps what its cells print and draw."""

from __future__ import annotations

import base64
import contextlib
import io
import json
import tempfile
from pathlib import Path
from typing import Any

from palette import WIDEST, reduced

NOTEBOOK = Path(__file__).parent / "first_hour.ipynb"
PNG = "image/png"


def read_notebook() -> dict[str, Any]:
    """The notebook, format 4.5 of Jupyter."""
    notebook: dict[str, Any] = json.loads(NOTEBOOK.read_text(encoding="utf-8"))
    return notebook


def run_notebook(notebook: dict[str, Any]) -> dict[str, Any]:
    """Run the cells in one namespace, in place of their outputs put those of this run, and return the notebook."""
    import matplotlib as mpl

    mpl.use("Agg")  # figures are taken from pyplot after each cell, as Jupyter does
    namespace: dict[str, Any] = {}
    cells = [cell for cell in notebook["cells"] if cell["cell_type"] == "code"]
    for number, cell in enumerate(cells, start=1):
        printed = io.StringIO()
        with contextlib.redirect_stdout(printed):
            exec(compile("".join(cell["source"]).replace("plt.show()", ""), f"cell {number}", "exec"), namespace)
        text = {"output_type": "stream", "name": "stdout", "text": printed.getvalue().splitlines(keepends=True)}
        cell["execution_count"] = number
        cell["outputs"] = [text] * bool(text["text"]) + _figures()
    return notebook


def _figures() -> list[dict[str, Any]]:
    import matplotlib.pyplot as plt

    outputs = []
    for number in plt.get_fignums():
        with tempfile.TemporaryDirectory() as folder:
            picture = Path(folder) / "figure.png"
            plt.figure(number).savefig(picture, dpi=120)
            data = {PNG: base64.b64encode(reduced(picture, WIDEST)).decode(), "text/plain": ["<Figure>"]}
        outputs.append({"output_type": "display_data", "data": data, "metadata": {}})
    plt.close("all")
    return outputs


def write_notebook_page(folder: Path) -> None:
    """Write the notebook as a page of the site into `folder`, its figures below it."""
    parts = []
    for cell in read_notebook()["cells"]:
        source = "".join(cell["source"])
        parts.append(source if cell["cell_type"] == "markdown" else f"```python\n{source}\n```")
        for output in cell.get("outputs", []):
            if "text" in output:
                parts.append(f"```text\n{''.join(output['text'])}```")
            else:
                picture = folder / "figures" / f"{NOTEBOOK.stem}_{cell['execution_count']}.png"
                picture.write_bytes(base64.b64decode(output["data"][PNG]))
                parts.append(f"![What the cell draws](figures/{picture.name})")
    parts.append(f"{{download}}`This page as a notebook <{NOTEBOOK.name}>`")
    (folder / f"{NOTEBOOK.stem}.md").write_text("\n\n".join(parts) + "\n", encoding="utf-8")


if __name__ == "__main__":
    content = json.dumps(run_notebook(read_notebook()), indent=1, ensure_ascii=False)
    NOTEBOOK.write_text(content + "\n", encoding="utf-8")
