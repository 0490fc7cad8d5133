"""The likeliest mistakes in the two-link case, and what their messages name.

    .venv/bin/python tests/cli/mistakes.py

writes docs/reference/messages.md with the messages as they are.
"""

import os
import shutil
from pathlib import Path
from tempfile import TemporaryDirectory

ROOT = Path(__file__).parents[2]
PAGE = ROOT / "docs" / "reference" / "messages.md"

TIP_X, TIP_Y = 'x = "1.5*cos(pi*t/4)"', 'y = "sqrt(3)/2*cos(pi*t/4)"'
BETWEEN_A = 'between = ["link1.tip", "link2.root"]'
FIRST_PZT = 'body = "link1"\ncount = 10'
INITIAL = "[initial]\n"
POINTS = '[[actuation_points]]\nbody = "link2"\n'

# What is wrong: ({old: new} in the scene, what the message names), or the file before these.
_CHANGES = {
    "unknown key": ({"motors =": "moters ="}, ["scene.toml: moters", 'did you mean "motors"?']),
    "unknown key in a table": (
        {"[initial]\n": "[initial]\nangels = 1\n"},
        ["initial.angels", 'did you mean "angles"?'],
    ),
    "link instead of a scene": (
        {"[[analysis]]": "[[geometry]]"},
        ["expected a scene file, found a link file", "ffrobot link"],
    ),
    "unknown key in a link": ("link2.toml", {"density": "densty"}, ["link2.toml: material.densty", '"density"']),
    "one bracket instead of two": (
        {"[[trajectory]]": "[trajectory]"},
        ["trajectory: expected a list, found", "(write [[trajectory]])"],
    ),
    "wrong type": ({"end = 1.0": 'end = "1.0"'}, ['analysis "inverse": end: expected a number, found "1.0"']),
    "missing link file": (
        {'link = "link1.toml"': 'link = "link11.toml"'},
        ['body "link1": link', '"link11.toml"', 'did you mean "link1.toml"?'],
    ),
    "negative density": (
        "link1.toml",
        {"density = 7850.0": "density = -7850.0"},
        ["link1.toml: material.density: expected a number greater than 0, found -7850.0"],
    ),
    "zero-length link": ("link1.toml", {"length = 1.0": "length = 0.0"}, ["link1.toml: geometry.length", "found 0.0"]),
    "singular start": (
        {TIP_X: 'x = "2 - t"', TIP_Y: 'y = "0"', "link2 = 1.0471975511965976": "link2 = 0.0"},
        ["initial", 'trajectory "tip"', "singular", "stretched"],
    ),
    "target out of reach": (
        {TIP_X: 'x = "1.5 + t"'},
        ['trajectory "tip"', "within reach", "at t = 0.3"],  # 1.5 + t, 0.866 is 2 m away at 0.3027 s
    ),
    "target out of reach at once": ({TIP_X: 'x = "2.5"'}, ['trajectory "tip"', "t = 0 s"]),
    "unknown interface": (
        {BETWEEN_A: 'between = ["link1.tpi", "link2.root"]'},
        ['joint "A": between', '"link1.tpi"', 'did you mean "tip"?'],
    ),
    "unknown body": ({BETWEEN_A: 'between = ["link3.tip", "link2.root"]'}, ['joint "A"', '"link3.tip"']),
    "patch beyond the end": (
        {FIRST_PZT: 'body = "link1"\ncenters = [0.1, 0.99]'},
        ['pzt "link1"', "patch 2 from 0.965 to 1.015 m"],
    ),
    "more modes than patches without least squares": (
        {FIRST_PZT: 'body = "link1"\ncount = 4'},
        ['pzt "link1": expected as many patches as modes (10) or more, found 4', 'allocation = "least-squares"'],
    ),
    "limit of zero": (
        {FIRST_PZT: f"{FIRST_PZT}\nlimit = 0.0", "density = 7600.0\nlimit = 200.0": "density = 7600.0"},
        ['pzt "link1": limit: expected a number greater than 0', "found 0.0"],
    ),
    "limit of zero among others": (
        {"limit = 200.0": f"limit = {[200.0] * 9 + [0.0]}"},
        ['pzt "link1": limit[9]: expected a number greater than 0, found 0.0'],
    ),
    "motor limit of zero": (
        {BETWEEN_A: f"{BETWEEN_A}\nmoment_limit = 0"},
        ['joint "A": moment_limit: expected a number greater than 0, found 0'],
    ),
    "limits for other patches": (
        {"limit = 200.0": "limit = [200.0, 100.0]"},
        ['pzt "link1"', "expected 10 limits, one for each patch, found 2"],
    ),
    "overlapping patches": (
        {FIRST_PZT: 'body = "link1"\ncenters = [0.1, 0.5, 0.13]'},
        ['pzt "link1"', "patch 1 (0.075 to 0.125 m) and patch 3 (0.105 to 0.155 m) on the same place"],
    ),
    "patch on a rigid body": (
        {
            'link = "link2.toml"': "rigid = { mass = 3.0, inertia = 0.3, center = [0.5, 0.0],"
            " points = { root = [0.0, 0.0], tip = [1.0, 0.0] } }"
        },
        ['pzt "link2": body: expected a flexible body, found "link2", which is rigid'],
    ),
    "more point components than coordinates": (
        {INITIAL: f"{POINTS}axial = [1.0]\ntransverse = {[k / 20 for k in range(1, 15)]}\n\n{INITIAL}"},
        ['actuation_points "link2": expected at most as many components as the body has coordinates (13), found 15'],
    ),
    "coincident points": (
        {INITIAL: f"{POINTS}transverse = [0.5, 'tip', 1.0]\n\n{INITIAL}"},
        ['actuation_points "link2": transverse: expected points apart', "two at tip and 1.0 that coincide"],
    ),
    "axial components of a link that only bends": (
        {INITIAL: f"{POINTS}axial = [0.5, 1.0]\n\n{INITIAL}"},
        ['actuation_points "link2": expected components that differ', "found 2 of which only 1 are independent"],
    ),
    "point beyond the end": (
        {INITIAL: f"{POINTS}transverse = [1.1]\n\n{INITIAL}"},
        ['actuation_points "link2": expected places within the link, 0 … 1 m, found 1.1 m'],
    ),
    "forces at points that are not there": (
        {'apply = "joints+pzt"': 'apply = "points"'},
        ['analysis "forward": apply: expected at least one [[actuation_points]] for "points", found none'],
    ),
    "trajectory forces of FCID": (
        {'kind = "pcid"': 'kind = "fcid"\nshape = "zero"', 'apply = "joints+pzt"': 'apply = "trajectory"'},
        ['analysis "forward": apply: expected "joints", "joints+pzt" or "points"', 'found "trajectory"'],
    ),
    "limits of a run without motors": (
        {'apply = "joints+pzt"': 'apply = "trajectory"\nlimits = true'},
        ['analysis "forward"', "expected limits = true only with apply", 'found apply = "trajectory"'],
    ),
    "shape that is not given": (
        {'kind = "pcid"': 'kind = "fcid"\nshape = "given"'},
        ['analysis "inverse"', 'expected the key "modal" in shape = "given", found none'],
    ),
    "shape of an unknown body": (
        {'kind = "pcid"': 'kind = "fcid"\nshape = "given"\nmodal = { link3 = ["0"] }'},
        ['analysis "inverse": modal', 'found "link3"'],
    ),
    "mass of patches without density": (
        {"density = 7600.0\n": "", "structural = false": 'structural = ["mass"]'},
        ['pzt "link1"', 'expected the key "density" with structural = ["mass"], found none'],
    ),
    "weights of modes and of points": (
        {FIRST_PZT: f"{FIRST_PZT}\nmode_weights = {[1.0] * 10}\npoint_weights = {{ tip = 1.0 }}"},
        ['pzt "link1"', 'expected one of the keys "mode_weights" and "point_weights", found both'],
    ),
    "too many modes": ("link1.toml", {"count = 10": "count = 500"}, ["link1.toml: modes.count", "found 500"]),
    "TOML syntax": ({'name = "two_link"': "name = "}, ["scene.toml: not a valid TOML scene file", "line"]),
    "TOML syntax in a link": ("link1.toml", {"[mesh]": "[mesh"}, ["link1.toml: not a valid TOML link file", "line"]),
    "domain error": ({TIP_X: 'x = "1.5 + 0.1*sqrt(0.5 - t)"'}, ['trajectory "tip": x', "t = 0.5 s", "domain"]),
    "no expression": ({TIP_X: 'x = "open(t)"'}, ['trajectory "tip": x', "unknown function 'open'"]),
    "motors that do not fit": (
        {BETWEEN_A: f"{BETWEEN_A}\nmotor = false", "at = [0.0, 0.0]": "at = [0.0, 0.0]\nmotor = true"},
        ["joint", "as many motors as", "(2)", 'found 1 ("O")'],
    ),
    "repeated constraints": (
        {"[initial]\n": '[[trajectory]]\nname = "again"\npoint = "link2.tip"\nx = "1.5"\n\n[initial]\n'},
        ["trajectory: expected at most 2 components", 'found 3 in "again", "tip"'],
    ),
    "output step that does not divide": (
        {"output_step = 0.001": "output_step = 0.0007"},
        ['analysis "inverse"', "output_step", "0.0007"],
    ),
    "tolerance below round-off": (
        {"tolerance = 1e-7": "tolerance = 1e-18"},
        ['analysis "inverse": tolerance', "1e-18"],
    ),
    "name with a line break": (
        {'name = "forward"': 'name = "for\\nward"'},
        ['analysis "for\\nward": name: expected a name without line breaks', 'found "for\\nward"'],
    ),
    "name with a slash": ({'name = "forward"': 'name = "a/b"'}, ['name: expected a name without "/"']),
    "name without quotes that is a date": (
        {'name = "forward"': "name = 2020-01-01"},
        ['analysis no. 2: name: expected no date or time, found 2020-01-01 (text is written in quotes: "2020-01-01")'],
    ),
    "number beyond all sense": (
        {"end = 1.0": "end = 1e300"},
        ['analysis "inverse": end: expected a number between -1e+30 and 1e+30, found 1e+300'],
    ),
    "number close to zero": (
        "link1.toml",
        {"density = 7850.0": "density = 1e-300"},
        ["link1.toml: material.density: expected a number of at least 1e-30, found 1e-300"],
    ),
    "whole number beyond all sense": (
        {FIRST_PZT: f"{FIRST_PZT}\nlayers = 1{'0' * 24}"},
        ['pzt "link1": layers: expected a whole number of at most 9.22e+18, found a larger one'],
    ),
    "more patches than any link has": (
        {FIRST_PZT: 'body = "link1"\ncount = 1000000000'},
        ['pzt "link1": count: expected a number of at most 1000, found 1000000000'],
    ),
    "number of thousands of digits": (
        {"end = 1.0": f"end = {'1' * 5000}"},
        ["scene.toml: not a valid TOML scene file: a whole number of too many digits"],
    ),
    "lists in lists": (
        {INITIAL: f"{INITIAL}x = {'[' * 40}{']' * 40}\n"},
        ["initial", "expected at most 32 tables and lists within each other"],
    ),
    "lists in lists without end": (
        "link1.toml",
        {"[mesh]": f"x = {'[' * 3000}{']' * 3000}\n[mesh]"},
        ["link1.toml: not a valid TOML link file: expected at most 32 tables and lists within each other"],
    ),
    "file name that is too long": (
        {'link = "link1.toml"': f'link = "{"a" * 5000}.toml"'},
        ['body "link1": link: expected an existing file, found "aaaa', "File name too long"],
    ),
    "folder instead of a file": ({'link = "link1.toml"': 'link = "."'}, ["which is a folder"]),
    "actuation that comes later": (
        {'actuation = "inverse"': 'actuation = "joints_only"'},
        ['analysis "forward": actuation', '"joints_only"'],
    ),
}
MISTAKES = {name: change if len(change) == 3 else ("scene.toml", *change) for name, change in _CHANGES.items()}


def edited(folder, file, edits):
    """Make the edits in a copy of the case."""
    text = (folder / file).read_text(encoding="utf-8")
    for old, new in edits.items():
        assert old in text, f"{file} has no {old!r}"
        text = text.replace(old, new)
    (folder / file).write_text(text, encoding="utf-8")


def row(mistake, message):
    """A row of the page's table; pipes would end a cell."""
    lines = [line.replace("|", "\\|") for line in message.splitlines()]
    return f"| {mistake} | {'<br>'.join(f'`{line}`' for line in lines)} |"


def without_folder(message, folder):
    """Where the files are is no part of what is said."""
    return message.replace(f"{folder}{os.sep}", "").replace(str(folder), "FOLDER").strip()


def message_of(mistake):
    """What the program says, without the folder."""
    import ffrobot

    file, edits, _ = MISTAKES[mistake]
    with TemporaryDirectory() as name:
        case = Path(name) / "two_link"
        shutil.copytree(ROOT / "cases" / "two_link", case, ignore=shutil.ignore_patterns("*.h5", "*.figures"))
        edited(case, file, edits)
        try:
            ffrobot.solve(case / "scene.toml")
        except ffrobot.InputError as error:
            return without_folder(str(error), case)
    raise AssertionError(f"{mistake}: no message")


def main():
    head = (
        "# Messages for common mistakes\n\n"
        "Each is one change in the files of `cases/two_link`; the tests make it and compare the message.\n\n"
        "| mistake | message |\n|---|---|\n"
    )
    PAGE.write_text(
        head + "\n".join(row(mistake, message_of(mistake)) for mistake in MISTAKES) + "\n", encoding="utf-8"
    )


if __name__ == "__main__":
    main()
