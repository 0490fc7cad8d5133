"""`ffrobot fit --frf`: keys of a scene fitted to frequency response functions in one or several poses.

Residuals are ln(H/H_measured)/σ at each frequency: logarithm of the magnitude, and phase (rad). The equations of motion
are linearized in the parameters θ, and linearized again at the optimum: except for effects of gravity they are linear
in stiffness, damping and masses, so that a few iterations suffice.

With Z = K + iωD − ω²M and rows J of the points' displacements, the receptance is H = J_r Z⁻¹ J_fᵀ, and

    dH = dJ_r X + Yᵀ dJ_fᵀ − Yᵀ dZ X,      X = Z⁻¹ J_fᵀ,  Y = Z⁻ᵀ J_rᵀ.
"""

from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass, replace
from functools import lru_cache
from itertools import compress, zip_longest
from pathlib import Path

import numpy as np

from ..common.arrays import Array, ComplexArray
from ..common.errors import InputError, SolveError
from ..common.files import AnyPath, check_new_file, write_atomically
from ..common.libraries import scipy
from ..common.structs import struct
from ..common.toml_files import load_toml
from ..common.validation import check_texts
from ..map.pose_map import check_point
from ..mbs.linear.joint_conditions import COMPLIANT, free_coordinates, vibration
from ..mbs.linear.poses import PoseEvaluator
from ..mbs.posture.start import undeformed_posture
from ..mbs.scene.mechanism import Initial
from ..mbs.scene.space import SPACES
from ..run.prepare import prepare_scene, unsolved
from ..run.result import Solution
from .covariance import write_covariance
from .fitting import Motors, RobotTarget, VariedKeys
from .frf_measured import MeasuredPose, read_tests
from .least_squares import MOST_EVALUATIONS, Parameters, check_distinguishable, uncertainty_of

POOR = 0.8  # FRAC of an FRF that the model hardly has
HEADING = ("test", "used for", "FRFs", "least FRAC", "mean FRAC", "peaks: largest error", "misfit")


def fit_responses(
    scene: AnyPath,
    tests: AnyPath,
    vary: Sequence[str],
    output: AnyPath | None = None,
    *,
    motors: Motors = "locked",
    force: bool = False,
) -> "ResponseFit":
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
    """The [initial] of a pose; None for that of the scene."""
    if not pose.test.pose:
        return None
    try:
        return target.scene({}, "static", pose.test.pose).initial
    except InputError as error:
        raise InputError(f'{tests}: test "{pose.test.name}": pose:\n{error}') from None


Equations = Callable[[Array], Sequence[Array]]
"""Function of the parameters (n,): arrays of M, K, D, J (`unstacked`) of all poses, always in the same coordinates."""


def unstacked(equations: Array) -> list[Array]:
    """Return M, K, D (f, f) and J (r, f), displacements per coordinate, SI units, of one array (3 f + r, f).

    f free coordinates; J has a row for each of the r directions of `MeasuredPose.ends`.
    """
    f = equations.shape[1]
    return np.split(equations, [f, 2 * f, 3 * f])


def receptance(
    equations: Array, pose: MeasuredPose, changes: Sequence[Array] = ()
) -> tuple[ComplexArray, ComplexArray]:
    """Return receptances H (F, p), m/N, of the p FRFs of a pose at its F frequencies, and derivatives (n, F, p).

    `equations` (3 f + r, f) are M, K, D and J in one array (`unstacked`). Derivatives, m/N per unit of a parameter, are
    those along n `changes`, each the derivative of `equations` by a parameter.
    """
    (M, K, D, J), f, r = unstacked(equations), pose.ends.force, pose.ends.response
    X, w = vibration(M, K, D, J, pose.omega), pose.omega[:, None, None]
    H: ComplexArray = np.asarray((J @ X)[:, r, f], dtype=complex)
    slopes = np.empty((len(changes), *H.shape), dtype=complex)
    if len(changes):
        Y = vibration(M.T, K.T, D.T, J, pose.omega).swapaxes(1, 2)
        for k, (dM, dK, dD, dJ) in enumerate(map(unstacked, changes)):
            dX = dK @ X + 1j * w * (dD @ X) - w**2 * (dM @ X)
            slopes[k] = (dJ @ X + Y @ dJ.T - Y @ dX)[:, r, f]
    return H, slopes


class PoseModel:
    """Equations of a robot in the pose of a test, with the same coordinates for all parameters.

    `initial`: the pose; None: the start of the scene. `motors`: "locked" or "free".
    """

    def __init__(self, pose: MeasuredPose, initial: Initial | None, motors: str) -> None:
        self.pose, self._initial, self._motors = pose, initial, motors
        self._free: Array | None = None
        self._rest: Array | None = None  # the first equilibrium

    def at(self, robot: Solution) -> Array:
        """Return M, K, D (f, f), J (r, f) of a robot about its equilibrium in the pose, SI units, in one array.

        Raises `InputError` for unknown points, `SolveError` without an equilibrium.
        """
        if self._initial is not None:
            scene = robot.scene.model_copy(update={"initial": self._initial, "trajectory": ()})
            robot = unsolved(replace(robot, scene=scene))
        q = undeformed_posture(robot.model).q
        first, *others = dict.fromkeys(row.point for row in self.pose.ends.directions)
        for point in (first, *others):
            check_point(robot, point, f'test "{self.pose.test.name}"')
        linear, rest = PoseEvaluator(robot.model, q, first, others=others).linear_equations(q, self._rest)
        if self._free is None:
            self._rest = rest
            self._free = free_coordinates(linear, COMPLIANT).N if self._motors == "locked" else np.eye(len(linear.M))
        N, d = self._free, len(SPACES[robot.model.scene.space].translations)
        J = np.array([np.array(row.axis[:d]) @ linear.points[row.point][:d] for row in self.pose.ends.directions])
        return np.vstack([N.T @ linear.M @ N, N.T @ linear.K @ N, N.T @ linear.D @ N, J @ N])


STEP = 1e-4  # relative, for derivatives of the equations
LINEAR = 1e-8  # relative error of linearized equations, from which they are linearized again: high modes dominate it
REACHED = 1e-9  # of ln θ: a last step
MOST_PLACES = 30
NO_EFFECT = 1e-9  # of a parameter at the start, against the largest: small damping has little effect
NO_MOTION = 1e-12  # of a measured FRF: the model has none
STANDS_OUT = float(np.log(2.0))  # of peaks, in the logarithm of the magnitude
SMOOTH = (0.3, 0.1, 0.03)  # of ln f: widths of first comparisons of magnitudes, which bring peaks together


@dataclass(frozen=True)
class PoseComparison:
    """The p FRFs of a pose at F frequencies, (F, p), m/N: measured, `before` and `after` the fit."""

    pose: MeasuredPose
    before: ComplexArray
    after: ComplexArray

    @property
    def frac(self) -> Array:
        """Frequency response assurance criteria (p,), no unit, 1 for equal shapes (Heylen and Avitabile, IMAC 1998)."""
        a, b = self.pose.receptance, self.after
        across = np.abs((a.conj() * b).sum(axis=0)) ** 2
        return across / ((np.abs(a) ** 2).sum(axis=0) * (np.abs(b) ** 2).sum(axis=0))

    @property
    def frequency_error(self) -> Array:
        """Relative errors (k,), no unit, of the fitted frequencies of the k peaks of the measured sum of magnitudes."""
        measured = _peaks(self.pose.frequency, self.pose.receptance, STANDS_OUT)
        fitted = _peaks(self.pose.frequency, self.after, 0.1 * STANDS_OUT)
        if not len(fitted):
            return np.zeros(0)
        return np.array([fitted[np.abs(fitted / f - 1.0).argmin()] / f - 1.0 for f in measured])

    @property
    def misfit(self) -> float:
        """Root mean square of |ln(H/H_measured)|, about the relative error."""
        return float(np.sqrt(np.mean(np.abs(np.log(self.after / self.pose.receptance)) ** 2)))

    def row(self) -> tuple[str, ...]:
        """Return the table row: test, use, number of FRFs, least and mean FRAC, error of peaks, misfit."""
        errors, frac = self.frequency_error, self.frac
        peaks = f"{100 * errors[np.abs(errors).argmax()]:+.2f} % of {len(errors)}" if len(errors) else "none"
        use = "validation" if self.pose.test.validation else "fit"
        of_frac = str(len(frac)), f"{frac.min():.4f}", f"{frac.mean():.4f}"
        return self.pose.test.name, use, *of_frac, peaks, f"{100 * self.misfit:.2g} %"


def _peaks(frequency: Array, H: ComplexArray, prominence: float) -> Array:
    """Frequencies of peaks that stand out by `prominence` of the logarithm, by the parabola through three points."""
    size = np.log((np.abs(H) * frequency[:, None]).sum(axis=1))
    at = scipy.signal.find_peaks(size, prominence=prominence)[0]
    left, middle, right = size[at - 1], size[at], size[at + 1]
    shift = 0.5 * (left - right) / (left - 2.0 * middle + right)
    return frequency[at] + shift * 0.5 * (frequency[at + 1] - frequency[at - 1])


@dataclass(frozen=True, kw_only=True)
class ResponseFit(Parameters):
    """Parameters fitted to FRFs, and a comparison of the FRFs in each pose."""

    poses: tuple[PoseComparison, ...]

    def comparison(self) -> tuple[Sequence[str], Iterator[Sequence[str]]]:
        """Heading and rows of the table of poses."""
        return HEADING, map(PoseComparison.row, self.poses)

    def remarks(self) -> Iterator[str]:
        """Yield notes on the accuracy of the fit, and on FRFs that the model lacks."""
        yield from super().remarks()
        for one in self.poses:
            for label, frac in zip(one.pose.labels, one.frac, strict=True):
                if frac < POOR:
                    where = f'test "{one.pose.test.name}": {label}'
                    yield f"{where}: FRAC {frac:.3f}: the model lacks something there"


@struct
class _Residuals:
    """Of FRFs in some poses, about θ = `center` (n,) exp x, with equations in `place` there and their `slopes` by θ."""

    poses: Sequence[MeasuredPose]
    center: Array
    place: Sequence[Array]
    slopes: Sequence[Sequence[Array]]

    def equations(self, x: Array) -> list[Array]:
        """The equations of all poses, linear in θ."""
        change = self.center * np.expm1(x)
        return [of + np.tensordot(change, by, axes=1) for of, by in zip(self.place, self.slopes, strict=True)]

    def at(self, x: Array, smoothing: Sequence[Array] = ()) -> tuple[Array, Array]:
        """Residuals (m,) and their derivatives (m, n) by x; with a `smoothing` of each pose of magnitudes alone."""
        values, slopes = [], []
        poses = zip(self.poses, self.equations(x), self.slopes, strict=True)
        for (pose, of, by), S in zip_longest(poses, smoothing):
            H, dH = receptance(of, pose, by)
            off = np.log(H / pose.receptance) / pose.deviation
            by_x = (self.center * np.exp(x))[:, None, None] * dH / H / pose.deviation
            parts = (off.real, off.imag) if S is None else (S @ off.real,)
            parts_by_x = (by_x.real, by_x.imag) if S is None else (S @ np.ascontiguousarray(by_x.real),)
            values += [part.ravel() for part in parts]
            slopes += [part.reshape(len(x), -1) for part in parts_by_x]
        return np.concatenate(values), np.hstack(slopes).T

    def least(self, width: float) -> Array:
        """The x (n,) of least squares, at most 1.5 away; of magnitudes smoothed over a `width` of ln f, if not 0."""
        smoothing = []  # (k, F) means over ln f with Gaussian weights, a quarter of their width apart
        for pose in self.poses if width else ():
            places = np.log(pose.frequency)
            apart = (np.arange(places[0], places[-1] + width / 4, width / 4)[:, None] - places) / width
            weights = np.exp(-0.5 * apart**2)
            smoothing.append(weights / weights.sum(axis=1, keepdims=True))

        @lru_cache(1)
        def at(x: bytes) -> tuple[Array, Array]:
            return self.at(np.frombuffer(x), smoothing)

        found = scipy.optimize.least_squares(
            lambda x: at(x.tobytes())[0],
            np.zeros(len(self.center)),
            jac=lambda x: at(x.tobytes())[1],
            bounds=(-1.5, 1.5),
            x_scale="jac",
            max_nfev=MOST_EVALUATIONS,
            xtol=1e-2 if width else 1e-11,
            ftol=1e-3 if width else 1e-14,
            gtol=None,
        )
        return found.x


def differentiated(equations: Equations, values: Array, place: Sequence[Array]) -> list[tuple[Array, ...]]:
    """Return derivatives of the poses' equations, [pose][parameter], by forward differences per unit of parameter.

    `place`: M, K, D, J of each pose in one array (`unstacked`), SI, as `equations` returns them at `values` (n,), in
    units of the keys.
    """
    found = []
    for step in np.diag(STEP * values):
        pairs = zip(equations(values + step), place, strict=True)
        found.append([(ahead - here) / step.sum() for ahead, here in pairs])
    return list(zip(*found, strict=True))


def _receptances(equations: Sequence[Array], poses: Sequence[MeasuredPose]) -> list[ComplexArray]:
    """The FRFs (F, p) of all poses, all of directions in which the robot moves."""
    found = [receptance(of, pose)[0] for of, pose in zip(equations, poses, strict=True)]
    for pose, H in zip(poses, found, strict=True):
        for label, h, measured in zip(pose.labels, H.T, pose.receptance.T, strict=True):
            if np.abs(h).max() <= NO_MOTION * np.abs(measured).max():
                raise InputError(
                    f'test "{pose.test.name}": {label}: expected an FRF of directions in which the model moves',
                    "one without motion in the model: leave it out",
                )
    return found


def fit_receptances(
    equations: Equations, keys: Sequence[str], start: Array, poses: Sequence[MeasuredPose]
) -> ResponseFit:
    """Find the parameters, from `start` (n,) on, whose FRFs are nearest to those measured in `poses`.

    `equations` returns M, K, D, J of each pose in one array (`unstacked`) for parameters (n,) in units of `keys`. Poses
    for validation are only compared.

    Raises:
        InputError: no pose to fit, deviations of some FRFs alone, or parameters that FRFs do not distinguish.
        SolveError: the iteration does not converge.
    """
    used = [not pose.test.validation for pose in poses]
    if not any(used):
        raise InputError("fit: expected a test that is not for validation", "none")
    fitted = list(compress(poses, used))
    averaged = {pose.test.averages is not None for pose in fitted}
    seen = {bool(known) for pose in fitted for known in pose.coherence.ravel() >= 0.0}
    if len(averaged) + len(seen) > 2:
        raise InputError("fit: expected coherence, and averages, of all fitted FRFs or of none", "them of some")

    def of_used(values: Array) -> list[Array]:
        return list(compress(equations(values), used))

    before = _receptances(equations(start), poses)
    theta, place, converged = start, of_used(start), False
    slopes = differentiated(of_used, theta, place)
    J = _Residuals(fitted, theta, place, slopes).at(np.zeros(len(start)))[1]
    check_distinguishable(J, keys, "FRFs", least=NO_EFFECT)
    for width in (*SMOOTH, *[0.0] * MOST_PLACES):
        about = _Residuals(fitted, theta, place, slopes)
        x = about.least(width)
        theta, place = theta * np.exp(x), of_used(theta * np.exp(x))
        parts = [
            (one, other) for pair in zip(place, about.equations(x), strict=True)
            for one, other in zip(*map(unstacked, pair), strict=True)
        ]  # fmt: skip
        if max(np.linalg.norm(one - other) / (np.linalg.norm(one) or 1.0) for one, other in parts) > LINEAR:
            slopes = differentiated(of_used, theta, place)
        elif converged := not width and bool(np.abs(x).max() <= REACHED):
            break
    r, J = _Residuals(fitted, theta, place, slopes).at(np.zeros(len(start)))
    check_distinguishable(J, keys, "FRFs")
    if not converged:
        raise SolveError(f"fit: no convergence within {MOST_PLACES} places: start nearer to the measured FRFs")
    return ResponseFit(
        keys=tuple(keys),
        start=start,
        value=theta,
        **uncertainty_of(J, r, known=True in averaged),
        poses=tuple(map(PoseComparison, poses, before, _receptances(equations(theta), poses))),
    )


def draw_responses(fit: ResponseFit, path: Path) -> Path:
    """Write a PNG picture of three poses and FRFs each, direct ones first, to `path` and return it.

    Magnitudes above phases, a column for each pose; dots measured, lines fitted.
    """
    from matplotlib.figure import Figure

    from ..pictures.figures.plot import image_of
    from ..pictures.figures.style import SIZE, literal, style
    from ..pictures.projection import COLORS

    poses = fit.poses[:3]
    with style():
        figure = Figure(figsize=(SIZE[0] * max(len(poses), 1), 1.4 * SIZE[1]), layout="constrained")
        axes = figure.subplots(2, len(poses), squeeze=False, sharex="col", height_ratios=(2, 1))
        for (above, below), one in zip(axes.T, poses, strict=True):
            pose, f = one.pose, one.pose.frequency
            order = sorted(range(len(pose.labels)), key=lambda k: pose.force[k] != pose.response[k])
            for k, color in zip(order[:3], COLORS, strict=False):
                measured, fitted = pose.receptance[:, k], one.after[:, k]
                above.semilogy(f, 1e3 * np.abs(measured), ".", color=color, markersize=2.0)
                above.semilogy(f, 1e3 * np.abs(fitted), color=color, label=pose.labels[k])
                below.plot(f, np.degrees(np.angle(measured)), ".", color=color, markersize=2.0)
                below.plot(f, np.degrees(np.angle(fitted)), color=color)
            above.set_title(f"{pose.test.name}{' (validation)' * pose.test.validation}", loc="left")
            above.set_ylabel("receptance (mm/N)")
            above.legend()
            below.set(xlabel="frequency (Hz)", ylabel="phase (°)", yticks=[-180, -90, 0, 90, 180])
        write_atomically(path, image_of(literal(figure), "png"), "picture", ours=True)
    return path
