"""The gallery of the cases, from their READMEs: `python docs/gallery.py` writes docs/cases.md.

A README has its title, what the case shows in its first paragraph, its key number in a quoted one, and pictures, of
which the first is shown. The site has the READMEs as pages of its own; the repository links to them.
"""

from __future__ import annotations

import re
from dataclasses import dataclass
from pathlib import Path

DOCS = Path(__file__).parent
CASES = DOCS.parent / "cases"
GALLERY = "cases.md"
HERE = "[The cases, with pictures and their key numbers](cases.md)"  # in index.md; on the site the gallery is there
ORDER = ("two_link", "lightened_arm", "slider_crank", "flexible_arm_inversion")  # first; the others by name


@dataclass(frozen=True)
class Case:
    """What the gallery shows of a case.

    Attributes:
        name: of its folder.
        shows: first paragraph of its README.
        key: its key number, and of what.
        picture: file below its folder.
    """

    name: str
    title: str
    shows: str
    key: str
    picture: str


def read_case(folder: Path) -> Case:
    """Raises `ValueError` where the README lacks a part."""
    text = (folder / "README.md").read_text(encoding="utf-8")
    title = re.match(r"# (.+)\n\n((?:.+\n)+)", text)
    key = re.search(r"^((?:> .*\n)+)", text, re.MULTILINE)
    picture = re.search(r"!\[.*?\]\((.+?)\)", text)
    if not (title and key and picture and key[1].startswith("> **")):
        raise ValueError(f"{folder}/README.md: expected a title, a paragraph, a key number (> **…**) and a picture")
    shows = " ".join(title[2].split())
    return Case(folder.name, title[1], shows, " ".join(key[1].replace("> ", "").split()), picture[1])


def cases() -> list[Case]:
    """All cases, in the order of the gallery."""
    found = {path.parent.name: read_case(path.parent) for path in sorted(CASES.glob("*/README.md"))}
    return [found.pop(name) for name in ORDER] + list(found.values())


def cards() -> str:
    """A section for each case: its name, a picture, the key number, what it shows."""
    return "\n".join(map(card, cases()))


def card(case: Case) -> str:
    """One of them."""
    title, folder = case.title, f"../cases/{case.name}"
    picture = f"![{title}]({folder}/{case.picture})"
    return f"### [{title}]({folder}/README.md)\n\n{picture}\n\n{case.key}\n\n{in_docs(case.shows, case.name)}\n"


def in_docs(text: str, case: str) -> str:
    """Links of a case's README as seen from here."""
    text = re.sub(r"\]\(\.\./(\w+)/README\.md\)", r"](../cases/\1/README.md)", text)
    return re.sub(r"\]\((?!\.\./|https?:)", f"](../cases/{case}/", text)


def gallery_page() -> str:
    """The text of docs/cases.md."""
    return (
        "# Cases\n\n<!-- written by docs/gallery.py from the READMEs of the cases -->\n\nEach case is a folder of"
        " `cases/` with its scene, figures and a README with the model, the mathematics and the expected numbers.\n\n"
        f"## Gallery\n\n{cards()}"
    )


def write_case_pages(folder: Path) -> None:
    """The READMEs as pages of the site, in `folder`."""
    folder.mkdir(exist_ok=True)
    for case in cases():
        text = (CASES / case.name / "README.md").read_text(encoding="utf-8")
        text = in_docs(text, case.name).replace("](../cases/", "](../../cases/")
        (folder / f"{case.name}.md").write_text(on_site(text, ""), encoding="utf-8")


def on_site(text: str, folder: str = "cases/") -> str:
    """Links to READMEs of cases as links to their pages, which are in `folder`."""
    return re.sub(r"\]\((?:\.\./)+cases/(\w+)/README\.md\)", rf"]({folder}\1.md)", text)


def read_on_site(name: str, text: str) -> str:
    """The source of a page as the site takes it: the first page shows the gallery, its own page lists the cases."""
    if name == "index":
        return text.replace(HERE, on_site(cards())).replace("first_hour.ipynb", "first_hour.md")
    if name == "cases":
        pages = "\n".join(f"cases/{case.name}" for case in cases())
        return f"{on_site(text)}\n```{{toctree}}\n:hidden:\n:maxdepth: 1\n\n{pages}\n```\n"
    return on_site(text, "../" * name.count("/") + "cases/")


if __name__ == "__main__":
    (DOCS / GALLERY).write_text(gallery_page(), encoding="utf-8")
