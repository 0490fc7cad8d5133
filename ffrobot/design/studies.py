"""Functions of the design commands. Their signatures, ranges and texts are those of the command line, too.

`commands.options.options_of` reads annotations, which are evaluated here; an entry of Args begins with the help.
"""

import inspect
from collections.abc import Callable, Sequence
from functools import wraps
from math import isfinite
from typing import TYPE_CHECKING, Annotated, Any, Literal, ParamSpec, TypedDict, TypeVar, Unpack, get_args, get_origin

from click import BadParameter, Context, FloatRange, IntRange, Parameter, ParamType

from ..common.errors import InputError, either
from ..common.files import AnyPath

if TYPE_CHECKING:
    from concurrent.futures import Executor

    from ..batch.batch import Batch
    from ..run.watcher import Watcher
    from .optimise import Front
    from .optimum_record import Optimum
    from .sensitivity import Sensitivity
    from .uncertainty_record import Uncertainty

P = ParamSpec("P")
R = TypeVar("R")

Method = Literal["auto", "slsqp", "trust-constr", "differential-evolution", "all"]


class FiniteRange(FloatRange):
    """Numbers from one bound to another, or beyond one; no NaN, no infinity."""

    def convert(self, value: Any, param: Parameter | None, ctx: Context | None) -> Any:
        """Return the number within the range; other input fails."""
        converted = super().convert(value, param, ctx)
        if not isfinite(converted):
            self.fail(f"{converted} is not a finite number.", param, ctx)
        return converted

    def _describe_range(self) -> str:
        return "" if self.min is None and self.max is None else super()._describe_range()


class RunOptions(TypedDict, total=False):
    """Options of all studies: number or executor of parallel runs, `retry` of failed ones, Python files, observer."""

    processes: Annotated[int, IntRange(1, 1000)]
    executor: "Executor | Batch | None"
    retry: bool
    allow_python: Sequence[AnyPath]
    watcher: "Watcher | None"


def _checked(function: Callable[P, R]) -> Callable[P, R]:
    """Raise `InputError` for numbers out of ranges, unknown choices, and text instead of lists."""
    signature = inspect.signature(function)
    annotations = {name: parameter.annotation for name, parameter in signature.parameters.items()}
    annotations["processes"] = RunOptions.__annotations__["processes"]

    @wraps(function)
    def call(*args: P.args, **given: P.kwargs) -> R:
        from ..common.validation import check_texts  # loads pydantic, which --help does without

        bound = dict(signature.bind(*args, **given).arguments)
        bound |= bound.pop("how", {})
        for name, value in bound.items():
            annotation, label = annotations.get(name), f"{function.__name__}: {name}"
            kind, *about = get_args(annotation) if get_origin(annotation) is Annotated else (annotation,)
            if get_origin(kind) is Sequence:
                check_texts(value, label)
            if get_origin(kind) is Literal and value not in get_args(kind):
                raise InputError(f"{label}: expected {either(get_args(kind))}, found {value!r}")
            if isinstance(value, float) and kind is int:
                raise InputError(f"{label}: expected a whole number, found {value:g}")
            for one in about:
                try:
                    if isinstance(one, ParamType) and value is not None:
                        one.convert(value, None, None)
                except BadParameter as error:
                    raise InputError(f"{label}: {error.message}") from None
        return function(*args, **given)

    return call


Responses = Annotated[Sequence[str], "RESPONSE"]
Ranges = Annotated[Sequence[str], "KEY=LOW:HIGH"]
Limits = Annotated[Sequence[str], '"RESPONSE <= NUMBER"']
MostRuns = Annotated[int, IntRange(1, 100_000)]
Tolerance = FiniteRange(1e-10, 1e-3)


@_checked
def sensitivity(
    scene: AnyPath,
    of: Responses,
    to: Annotated[Sequence[str], "KEY,KEY …"],
    output: AnyPath | None = None,
    *,
    step: Annotated[float, FiniteRange(1e-6, 0.2)] = 0.01,
    tolerance: Annotated[float | None, Tolerance] = None,
    **how: Unpack[RunOptions],
) -> "Sensitivity":
    """Derivatives of scalar responses with respect to keys of a scene and its links: `ffrobot sensitivity`.

    Args:
        scene: the scene file.
        of: scalar response. A sequence, such as ["peak joints.elbow.moment"].
        to: parameters. Keys with dots, such as "payload.0.mass".
        output: folder of the runs, which a later call reuses; None: they are not kept.
        step: largest change of a parameter, relative to its value.
        tolerance: tolerance of the runs, if the scene has a larger one.  [default: 1e-07 with reused time steps, else
            1e-09]
        how: `processes`, runs in parallel here, or `executor`, which performs them: one of `concurrent.futures`,
            `mpi4py.futures` or dask, with processes that import ffrobot. `retry`: whether to repeat designs that failed
            before. `allow_python`: files and folders whose Python files may run. `watcher`: an object that observes
            progress and can stop the study.

    Returns:
        Derivatives with their errors.

    Raises:
        InputError: responses or keys are wrong, or a key has no other valid value.
        SolveError: the scene itself cannot be solved.

    Example:
        found = ffrobot.sensitivity("scene.toml", ["peak joints.elbow.moment"], ["payload.0.mass"])
    """
    from .designs import runs_of
    from .sensitivity import find_sensitivity

    with runs_of(scene, output, **how) as runs:
        return find_sensitivity(runs, of, to, step, tolerance)


@_checked
def optimise(
    scene: AnyPath,
    vary: Ranges,
    output: AnyPath | None = None,
    *,
    minimise: Annotated[str | None, "RESPONSE"] = None,
    maximise: Annotated[str | None, "RESPONSE"] = None,
    subject_to: Limits = (),
    method: Method = "auto",
    starts: Annotated[int, IntRange(1, 1000)] = 1,
    seed: Annotated[int, IntRange(0, 2**32 - 1)] = 0,
    runs: MostRuns = 1000,
    tolerance: Annotated[float, Tolerance] = 1e-8,
    **how: Unpack[RunOptions],
) -> "Optimum":
    """Find the design with the smallest or largest objective within limits: `ffrobot optimise`.

    Args:
        scene: the scene file.
        vary: parameter with its range or set. A sequence, such as ["links.arm.geometry.section.outer=0.02:0.08",
            "joint.1.gear_ratio in {50, 80, 100}"].
        output: folder of the designs, which a later call reuses; None: they are not kept.
        minimise: response to minimize, as in sensitivity.
        maximise: response to maximize.
        subject_to: limit, "<=" or ">=". A sequence, such as ["peak joints.elbow.moment <= 20"].
        method: the optimizer. "auto" is "slsqp", and with discrete sets "all" of them or "differential-evolution".
        starts: searches along gradients. They begin at the scene and at points of a Latin hypercube.
        seed: seed of random numbers.
        runs: largest number of runs.
        tolerance: tolerance of the runs, if the scene has a larger one.
        how: options of the runs, as in `sensitivity`.

    Returns:
        The best design; if none satisfies the limits, the nearest one, with `feasible` False.

    Raises:
        InputError: responses, limits or keys are wrong, or bounds exclude all designs.
        SolveError: no design completed.

    Example:
        best = ffrobot.optimise(
            "scene.toml",
            ["links.arm.geometry.section.outer=0.02:0.08"],
            minimise="mass",
            subject_to=["peak joints.elbow.moment <= 20"],
        )
    """
    from .designs import runs_of
    from .optimise import find_optimum

    with runs_of(scene, output, **how) as runner:
        return find_optimum(
            runner, vary, minimise, maximise, subject_to,
            method=method, starts=starts, seed=seed, runs=runs, tolerance=tolerance,
        )  # fmt: skip


@_checked
def trade_off(
    scene: AnyPath,
    vary: Ranges,
    output: AnyPath | None = None,
    *,
    minimise: str,
    against: Annotated[str, "RESPONSE"],
    points: Annotated[int, IntRange(3, 1000)] = 8,
    subject_to: Limits = (),
    runs: MostRuns = 1000,
    tolerance: Annotated[float, Tolerance] = 1e-8,
    **how: Unpack[RunOptions],
) -> "Front":
    """Pareto front: smallest first response for `points` values of a second one: `ffrobot optimise … --against`.

    Args:
        scene: the scene file.
        vary: parameters, as in `optimise`.
        output: folder of the designs, which a later call reuses; None: they are not kept.
        minimise: the first response.
        against: second response to minimize: Pareto front of both.
        points: number of designs on that front.
        subject_to: limits, as in `optimise`.
        runs: largest number of runs of all searches together.
        tolerance: tolerance of the runs, if the scene has a larger one.
        how: options of the runs, as in `sensitivity`.

    Returns:
        The designs of the front.

    Raises:
        InputError: as in `optimise`; discrete sets; responses with the same optimum.
        SolveError: the initial design of a search does not complete.

    Example:
        front = ffrobot.trade_off(
            "scene.toml", ["joint.1.gear_ratio=10:200"], minimise="mass", against="rms tip_error", points=6
        )
    """
    from .designs import runs_of
    from .optimise import find_front

    with runs_of(scene, output, **how) as runner:
        return find_front(runner, vary, minimise, against, points, subject_to, runs=runs, tolerance=tolerance)


@_checked
def uncertainty(
    scene: AnyPath,
    of: Annotated[Sequence[str], "RESPONSE|HISTORY"],
    spread: Annotated[Sequence[str], "KEY=SPREAD"],
    output: AnyPath | None = None,
    *,
    samples: Annotated[int, "N"] = 200,
    seed: Annotated[int, IntRange(0, 2**63 - 1)] = 0,
    by: Literal["samples", "gradients"] = "samples",
    indices: bool = False,
    **how: Unpack[RunOptions],
) -> "Uncertainty":
    """Statistics of responses and histories for uncertain keys: `ffrobot uncertainty`.

    Args:
        scene: the scene file.
        of: response or history. A sequence, such as ["peak joints.elbow.moment", "joints.elbow.moment"].
        spread: uncertain parameter with its distribution. A sequence, such as ["payload.0.mass=±5%"].
        output: folder of the runs, which a later call reuses; None: they are not kept.
        samples: number of samples of a Latin hypercube.
        seed: seed of the samples.
        by: "samples", or "gradients" with two runs per key.
        indices: Sobol indices, with N/2 more runs per parameter.
        how: options of the runs, as in `sensitivity`.

    Returns:
        Mean, deviation and quantiles of responses, and bands of histories.

    Raises:
        InputError: responses, keys or distributions are wrong.
        SolveError: the nominal scene, or all others, cannot be solved.

    Example:
        found = ffrobot.uncertainty("scene.toml", ["peak joints.elbow.moment"], ["payload.0.mass=±5%"], samples=100)
    """
    from .designs import runs_of
    from .uncertainty import find_uncertainty

    with runs_of(scene, output, **how) as runs:
        return find_uncertainty(runs, of, spread, samples, seed, by, indices=indices)
