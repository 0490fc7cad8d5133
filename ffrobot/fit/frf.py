"""`ffrobot fit --frf`: keys of a scene fitted to frequency response functions in one or several poses."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import replace
from pathlib import Path

import numpy as np
from rich.console import Console

from ..common.arrays import Array
from ..common.errors import InputError
from ..common.files import AnyPath, check_new_file
from ..common.toml_files import load_toml
from ..common.validation import check_texts
from ..mbs.scene.mechanism import Initial
from ..present.lines import print_table
from ..run.prepare import prepare_scene
from .covariance import write_covariance
from .fitting import Motors, RobotTarget, VariedKeys, correlated, print_parameters
from .frf_fit import PoseComparison, PoseModel, ResponseFit, fit_receptances
from .frf_measured import MeasuredPose, read_tests

UNSEEN = 0.5  # relative deviation of a parameter from which the tests hardly see it
POOR = 0.8  # FRAC of an FRF that the model hardly has


def fit_responses(
    scene: AnyPath,
    tests: AnyPath,
    vary: Sequence[str],
    output: AnyPath | None = None,
    *,
    motors: Motors = "locked",
    force: bool = False,
) -> ResponseFit:
    """Fit keys of a scene to measured frequency response functions (FRFs): `ffrobot fit --frf`.

    Args:
        scene: the scene file.
        tests: TOML file with a table [[test]] for each pose: files of FRFs, units, points.
        vary: keys with dots; "KEY=KEY" have a common factor.
        output: new file; None: next to the old one, with a name that ends in `.fitted.toml`.
        motors: state of the motors during the tests, `locked` (the default) or `free`.
        force: whether to replace existing files.

    Returns:
        Fitted values with their deviations, FRFs before and after (m/N), and the new files.

    Raises:
        InputError: files or keys are wrong, FRFs do not distinguish parameters, or a file exists.
        SolveError: no convergence, or a pose without equilibrium.

    Example:
        fit = ffrobot.fit_responses("arm.toml", "hammer.toml", ["joint.elbow.stiffness", "joint.elbow.damping"])
        fit.value, fit.poses[0].frac
    """
    check_texts(vary, "fit_responses: vary")
    path = Path(scene)
    if "geometry" in load_toml(path, "link or scene file"):
        raise InputError(f"{path}: --frf: expected a scene file", "a link file: weld the link to the ground in one")
    target = RobotTarget(path, motors)
    varied = VariedKeys(path, target, vary, output)
    varied.check_new(replace=force)
    covariance = varied.written[-1].with_suffix(".covariance.toml")
    check_new_file(covariance, replace=force)
    measured = read_tests(Path(tests))
    poses = [PoseModel(one, _start(Path(tests), target, one), motors) for one in measured]

    def equations(values: Array) -> list[Array]:
        with varied.named(values):
            robot = prepare_scene(target.scene(varied.changes(values), "static"))
            return [pose.at(robot) for pose in poses]

    found = fit_receptances(equations, varied.names, varied.start, measured)
    files = varied.write(found.value)
    write_covariance(found, covariance)
    return replace(found, files=(str(covariance), *files))


def _start(tests: Path, target: RobotTarget, pose: MeasuredPose) -> Initial | None:
    """The [initial] of a pose; None for that of the scene. Raises `InputError` with the name of the test."""
    if not pose.test.pose:
        return None
    try:
        return target.scene({}, "static", pose.test.pose).initial
    except InputError as error:
        raise InputError(f'{tests}: test "{pose.test.name}": pose:\n{error}') from None


def print_responses(fit: ResponseFit, console: Console) -> None:
    """Tables of parameters and poses, remarks, and the files written."""
    print_parameters(fit, console)
    heading = ("test", "used for", "FRFs", "least FRAC", "mean FRAC", "peaks: largest error", "misfit")
    print_table(console, heading, map(_row, fit.poses))
    for line in (*remarks(fit), *(f"written: {path}" for path in fit.files)):
        console.print(line, soft_wrap=True)


def _row(one: PoseComparison) -> tuple[str, ...]:
    errors = one.frequency_error
    peaks = f"{100 * errors[np.abs(errors).argmax()]:+.2f} % of {len(errors)}" if len(errors) else "none"
    use = "validation" if one.pose.test.validation else "fit"
    frac = one.frac
    return (
        one.pose.test.name, use, str(len(frac)), f"{frac.min():.4f}", f"{frac.mean():.4f}", peaks,
        f"{100 * one.misfit:.2g} %",
    )  # fmt: skip


def remarks(fit: ResponseFit) -> Iterator[str]:
    """Notes on what the tests say of the parameters, and on FRFs that the model lacks."""
    for key, deviation in zip(fit.keys, fit.relative_deviation, strict=True):
        if deviation > UNSEEN:
            yield f"the tests hardly see {key}: its standard deviation is {100 * deviation:.2g} % of it"
    yield from correlated(fit)
    for one in fit.poses:
        for response, frac in zip(one.pose.responses, one.frac, strict=True):
            if frac < POOR:
                yield f'test "{one.pose.test.name}": {response.label}: FRAC {frac:.3f}: the model lacks something there'
