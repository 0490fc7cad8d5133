"""Planar scenes sent through records and analyses of 3D, to the core in the plane: the planar results.

What it writes otherwise is in `OTHERWISE`: a test fails where an entry is no longer needed.
"""

import io
import re
from unittest import mock

import h5py
import planar_in_space
import pytest
import reference_numbers
from reference_scenes import CASES, PLANAR

import ffrobot
from ffrobot.results.spatial import spatial_image
from ffrobot.results.write import results_image
from ffrobot.run.solve import solve
from ffrobot.run.spatial import solve_spatial
from ffrobot.run.watcher import Watcher
from ffrobot.scene.load import make_scene

ALLOWED = 0.1  # times the tolerance of references: 1e-7 of the size of most datasets
OF_SMALL_DIFFERENCES = 5.0, "/(modal_force|voltage|required_voltage)$"  # of large forces, where links sag
OF_PEAKS = 1.0  # 2e-2: they are read off at times of steps, and steps differ
MORE = "/momentum/|/modal_force$|/joints/[^/]*(/(motor_)?moment(@|$)|@peak_power)"
"""What the one writer adds: momentum, modal forces of linear analyses, moments of motors in replays."""
END = 0.05  # s, of analyses of cases that say how long they are
OTHERWISE = {
    "@integrator$": ("slider_crank", "chosen by what its own evaluations cost"),
    "@(stiffness_change|stiffening_effect|foreshortening_moment|(position|relative)_error)$": (
        "arm",
        "by loads of links in 3D",
    ),
    "/residual_force$": ("two_link_patched", "of modes of loaded links, whose signs are free"),
    "@moments_repeated$": ("arm_with_modes_as_needed", "of some times between outputs, which differ"),
    "/constraint_violation$": (
        "loop_with_friction",
        "of accelerations relative to those of coordinates, not to all terms of a constraint",
    ),
    "@start_jolt$": ("slider_crank", "accelerations that a loop forces are those of joints"),
}
"""Datasets that the road writes otherwise, a scene that shows it, and why."""
OTHERWISE_IN = {
    "arm_with_attachment_modes": (".", "masses of attachment modes are raised in the plane alone"),
    "arm_in_pieces": (".", "likewise"),
    "compliant_arm": (".", "likewise"),
    "lightest_arm": (".", "likewise"),
    "arm_with_gears": (".", "bodies that carry rotors feel the twist of compliant gears in space alone"),
    "arm_under_control": ("^linear/.*@", "peaks are those of the run that is linearized in the plane"),
    "arm_stiffened": ("/predicted_shift$", "points of stiffened links move to first order there in the plane"),
    "lightened_arm": (
        "/stress/|^motors_alone|/modal_velocity$|/dissipated_power$",
        "loads of stresses have no z in the plane; replays are splines in space",
    ),
    "flexible_arm_inversion": (
        "^(exact_forward|moment_instead|force_at_tip)[/@]",
        "replays are splines in space, rounding errors grow",
    ),
    "two_link_rest_to_rest": (
        "/modal|/pzt/|/predicted_shift$",
        "patches serve all modes of files in space, those kept in the plane",
    ),
    "two_link_placement": ("^path_link", "places on a path are judged at one time in the plane"),
}
"""The same by scene."""


def shortened(path):
    """The tables of a case with four analyses, inverse ones of `END` unless times are chosen."""
    tables = planar_in_space.read(path)
    tables["analysis"] = tables["analysis"][:4]
    is_cut = not any("times" in analysis for analysis in tables["analysis"])
    for analysis in tables["analysis"]:
        if is_cut and "end" in analysis and analysis["kind"] != "motors-only":
            analysis["end"] = END
    return tables


CASES_IN_PLANE = {
    name: path
    for name, path in CASES.items()
    if path.stem == "scene" and 'space = "spatial"' not in path.read_text(encoding="utf-8")
}


def tables_of(name):
    """Of the scene, with tolerances of 1e-9 where it is integrated."""
    with mock.patch.object(ffrobot, "make_scene", lambda **tables: tables):  # which those functions end with
        tables = PLANAR[name]() if name in PLANAR else shortened(CASES_IN_PLANE[name])
    closer = [
        analysis | ({"tolerance": 1e-9} if analysis["kind"] in ("pcid", "forward") else {})
        for analysis in tables["analysis"]
    ]
    return tables | {"analysis": closer}


def solved_in_3d(tables):
    """By the records and the analyses of 3D scenes."""
    return solve_spatial(make_scene(**tables), Watcher())


def entries(image):
    """All datasets and attributes of numbers, by name."""
    with h5py.File(io.BytesIO(image)) as file:
        return reference_numbers.reduced(file)


def differences(name):
    """Of the file that the road writes of a scene from that of the plane, those that are not allowed by name."""
    tables = tables_of(name)
    expected = entries(results_image(solve(ffrobot.make_scene(**tables))))
    found = entries(spatial_image(solved_in_3d(tables)))
    found = {key: of for key, of in found.items() if key in expected or not re.search(MORE, key)}
    compared = reference_numbers.differences(found, expected, reference_numbers.SENSITIVE.get(name, ()))
    return {each.name: each for each in compared if each.share > allowed(each.name) and not is_nothing(each, expected)}


def allowed(name):
    if "@" in name or "/feasibility/" in name:
        return OF_PEAKS
    more, pattern = OF_SMALL_DIFFERENCES
    return more if re.search(pattern, name) else ALLOWED


def is_nothing(difference, expected):
    """Whether both are zero but for rounding."""
    return not (difference.words or expected[difference.name].size) and difference.apart < 1e-6


@pytest.mark.parametrize("name", [*PLANAR, *CASES_IN_PLANE])
def test_results_of_the_plane(name):
    beyond = differences(name)
    listed = [pattern for pattern, (shown_by, _) in OTHERWISE.items() if shown_by == name]
    listed += [OTHERWISE_IN[name][0]] if name in OTHERWISE_IN else []
    for pattern in listed:
        is_otherwise = any(re.search(pattern, dataset) for dataset in beyond)
        assert is_otherwise, f"{pattern} is as in the plane: take it off the list"
    known = "|".join([*OTHERWISE, *listed])
    unknown = [str(each) for dataset, each in beyond.items() if not re.search(known, dataset)]
    assert not unknown, "\n".join(unknown[:12])
