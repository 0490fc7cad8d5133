"""Responses and limits of designs, as options `--of`, `--minimise` and `--subject-to` name them."""

import re
from collections.abc import Callable, Sequence
from contextlib import suppress
from dataclasses import replace
from functools import partial

import numpy as np

from ..actuation.motor_catalog import CatalogMotor, choice_of
from ..common.arrays import Array
from ..common.errors import InputError, check_known, either, quoted
from ..common.peaks import root_mean_square, shares
from ..common.structs import struct
from ..common.tables import shown
from ..fe_models.modal_body import ModalBody
from ..present.feasibility import joint_tasks
from ..results.file import Results
from ..sweep.files import number_of, value_of
from .readings import MISSED, POWER, UNCERTAIN, History, Peak, Reading, Response, read_column
from .variables import DesignSpace, DesignVariable


@struct
class OfMotors(Response):
    """Response of motors that the variables `chosen` select: total "mass" (kg) or "cost", or the largest "share".

    The share is that of rated torque (by the RMS), of peak torque, or of speed; 1 at the limit.
    """

    what: str
    text: str
    chosen: tuple[DesignVariable, ...] = ()

    def read(self, results: Results) -> Reading:
        """Return the response for the motors in the scene of `results`; shares also depend on the motion there."""
        if not self.chosen:
            raise InputError(f'"{self.text}": expected `optimise` with --vary "motor JOINT in CATALOG"', "none")
        values = []
        for variable in self.chosen:
            row = tuple(value_of(results.scene, key) for key in variable.keys)
            motor = variable.motors[variable.rows.index(row)]
            if self.what == "share":
                values.append(self._share(results, variable.keys[0][1], motor, row[0]))
            elif (value := getattr(motor, self.what)) is None:
                raise InputError(f'"{self.text}": expected a {self.what} of motor "{motor.name}"', "none")
            else:
                values.append(value)
        return Reading(max(values)) if self.what == "share" else Reading(sum(values), "kg" * (self.what == "mass"))

    def _share(self, results: Results, joint: str, motor: CatalogMotor, ratio: float) -> float:
        tasks = (task for name in results.analyses for of, task in joint_tasks(results, name) if of == joint)
        shares = [max(choice_of(task, motor, ratio).shares) for task in tasks]
        if not shares:
            raise InputError(f'"{self.text}": expected a motion of joint "{joint}" with its torque', "none")
        return max(shares)


ROUND_OFF = 1e-9  # of a history: by so much means of nothing may differ


@struct
class OfHistory(Response):
    """The "rms", "mean" or "integral" of a history of one column, or its value "at" t, s."""

    word: str
    text: str
    name: str
    t: float = np.nan

    def read(self, results: Results) -> Reading:
        """Return the response in the unit of the history; that of integrals is multiplied by s."""
        history = read_column(results, self.name, f'"{self.text}"')
        unit = f"{history.unit}·s" if history.unit and self.word == "integral" else history.unit
        unit = {"W·s": "J"}.get(unit, unit)
        value, by_all = self._value(history, by_all=False), self._value(history, by_all=True)
        if abs(by_all - value) > MISSED * max(abs(by_all), abs(value)) + ROUND_OFF * history.rms:
            return Reading(by_all, unit, missed_by=value)
        return Reading(value, unit, doubt=UNCERTAIN if history.is_in_doubt else "")

    def follow(self, results: Results, nominal: Reading) -> Reading:
        """Return the value in the results of a changed scene."""
        history = read_column(results, self.name, f'"{self.text}"')
        return Reading(self._value(history, by_all=nominal.is_between))

    def _value(self, history: History, *, by_all: bool) -> float:
        """By outputs, or by all times that the run looked at: NaN where that is not known."""
        time, values = history.time, history.values[:, 0]
        if self.word == "at":
            if not time[0] <= self.t <= time[-1]:
                raise InputError(f'"{self.text}": expected a time from {time[0]:g} to {time[-1]:g} s', f"{self.t:g}")
            return history.at(self.t, 0)
        if self.word == "rms":
            return history.rms if by_all else root_mean_square(time, values)
        mean = history.mean if by_all else float(shares(time) @ values)
        return mean * float(np.ptp(time)) if self.word == "integral" else mean


@struct
class OfSettling(Response):
    """The "residual" vibration of a point, m, or its "settling" time, s; see `mbs.quantities.settling`."""

    what: str
    text: str
    point: str
    is_of_rest = True

    @property
    def analysis(self) -> str:
        """Name of the analysis in front of the point; empty without one."""
        return self.point.rpartition("/")[0]

    def read(self, results: Results) -> Reading:
        """Return residual (m) or time (s); if the point does not settle, the time from the path's to the run's end."""
        analysis, about = results.settling(self.point, f'"{self.text}"')
        if self.what == "residual":
            return Reading(float(about["residual"]), "m")
        if np.isfinite(value := float(about["time_to"])):
            return Reading(value, "s")
        rest = float(results.time(analysis)[-1] - about["path_end"])
        return Reading(rest, "s", doubt="not settled at the end of the run: at least that, take a later end")


@struct
class OfFrequency(Response):
    """Natural frequency of a link, Hz; `number` counts eigenmodes from 1 in the order of the modal body."""

    text: str
    number: int
    body: str
    needs_motion = False

    def read(self, results: Results) -> Reading:
        """Return the frequency (Hz) from the modal body of the results."""
        body = self._body(results)
        if not 1 <= self.number <= body.eigenmode_count:
            raise InputError(
                f'"{self.text}": expected the number of a mode of {self.body}, 1 to {body.eigenmode_count}', self.number
            )
        return Reading(float(body.frequency[self.number - 1]), "Hz", mode=_modes(body)[self.number - 1])

    def follow(self, results: Results, nominal: Reading) -> Reading:
        """Return the frequency (Hz) of the same mode of its family, even if its number has changed."""
        body = self._body(results)
        modes = _modes(body)
        if nominal.mode not in modes:
            return Reading(np.nan, elsewhere=f"the link file has too few modes for {nominal.mode}")
        return Reading(float(body.frequency[modes.index(nominal.mode)]))

    def _body(self, results: Results) -> ModalBody:
        known = results.modal_files
        check_known(self.body, known, f'"{self.text}": expected a body with a link ({quoted(known)})')
        return results.modal_body(self.body)


@struct
class OfMass(Response):
    """Mass of one body, or of all bodies, kg, without payloads and patches."""

    text: str
    body: str = ""
    needs_motion = False

    def read(self, results: Results) -> Reading:
        """Return the mass (kg) from modal bodies and `rigid` tables."""
        bodies = {str(body["name"]): body for body in results.scene["body"]}
        if self.body:
            check_known(self.body, bodies, f'"{self.text}": expected a body ({quoted(bodies)})')
        mass = 0.0
        for name in [self.body] if self.body else bodies:
            if name in results.modal_files:
                mass += results.modal_mass(name)
            elif isinstance(rigid := bodies[name].get("rigid"), dict):
                mass += float(rigid.get("mass", 0.0))
        return Reading(mass, "kg")


@struct
class OfValue(Response):
    """A number of the scene file itself, such as the duration of a path; not of link files."""

    text: str
    key: str
    needs_motion = False

    def read(self, results: Results) -> Reading:
        """Return the number in the scene of the results."""
        return Reading(number_of(results.scene, tuple(self.key.split(".")), f'"{self.text}"'))


FORMS: dict[str, Callable[..., Response]] = {
    "peak HISTORY": Peak,
    **{f"{word} HISTORY": partial(OfHistory, word) for word in ("rms", "mean", "integral")},
    "at TIME HISTORY": lambda text, time, name: OfHistory("at", text, name, float(time)),
    "energy joints.NAME": lambda text, joint: OfHistory("integral", text, f"{joint}.{POWER}"),
    **{f"{what} POINT": partial(OfSettling, what) for what in ("residual", "settling")},
    "frequency NUMBER BODY": lambda text, number, body: OfFrequency(text, int(number), body),
    "mass": OfMass,
    "mass BODY": OfMass,
    **{f"motors {what}": partial(OfMotors, what) for what in ("mass", "cost", "share")},
    "value KEY": OfValue,
}
"""Functions that make responses of their text and its words in capitals here."""


def parse_response(text: str, option: str = "--of") -> Response:
    """Return the response that `text`, one of `FORMS`, names. Raises `InputError` if it is none of them."""
    words = text.split()
    for form, make in FORMS.items():
        pairs = list(zip(form.split(), words, strict=False))
        if len(words) == len(form.split()) and all(part == word or not part.islower() for part, word in pairs):
            with suppress(ValueError):
                return make(text, *(word for part, word in pairs if not part.islower()))
    raise InputError(f"{option}: expected {either(FORMS)}", f'"{text}"')


def _modes(body: ModalBody) -> list[str]:
    """Family and number in it, from 1, of the eigenmodes."""
    families = body.family[: body.eigenmode_count]
    return [f"{family} {families[: k + 1].count(family)}" for k, family in enumerate(families)]


LIMIT = re.compile(r"(?P<response>.*\S)\s*(?P<sense><=|>=)\s*(?P<bound>\S+)\s*")

LINEAR = 0.1  # ratio to a response's size: logarithms above, tangent below, as responses may be negative
KEPT = 1e-6  # of a limit: what is beyond it by no more keeps it


@struct
class Limit:
    """Limit of a response: `sense` · (response − bound) ≤ 0; `sense` is 1 of "<=" and −1 of ">="."""

    response: Response
    sense: float
    bound: float

    @property
    def text(self) -> str:
        """The limit as text: `peak joints.elbow.moment <= 20`."""
        return f"{self.response.text} {'<=' if self.sense > 0 else '>='} {self.bound:g}"

    @property
    def scale(self) -> float:
        """Scale of the excess: |bound|, or 1 SI unit if the bound is 0."""
        return abs(self.bound) or 1.0

    def excess(self, value: float) -> float:
        """Return the excess of a value over the limit, relative to `scale`; negative within it."""
        return self.sense * (value - self.bound) / self.scale


@struct
class DesignProblem:
    """Optimization problem: minimize (`sense` 1) or maximize (−1) the objective within m `limits`.

    `scale`: value of the objective in the first design.
    """

    objective: Response
    sense: float
    limits: tuple[Limit, ...]
    scale: float = 1.0

    @property
    def responses(self) -> tuple[Response, ...]:
        """Response of the objective, then of each limit."""
        return (self.objective, *(limit.response for limit in self.limits))

    def scaled(self, values: Sequence[float]) -> Array:
        """Return (1 + m,) scaled objective F, to be minimized, and constraints g ≤ 0, no unit, of values in SI units.

        They are logarithms of values over their scales, below `LINEAR` tangents of them.
        """
        return self._scaled(values)[0]

    def factors(self, values: Sequence[float]) -> Array:
        """Return derivatives (1 + m,) of `scaled` by the unscaled responses, 1/their units."""
        return self._scaled(values)[1]

    def _scaled(self, values: Sequence[float]) -> tuple[Array, Array]:
        """Logarithms of ratios, and their derivatives; below `LINEAR`, and where a bound is 0, on a tangent."""
        bounds = np.array([self.scale, *(limit.bound for limit in self.limits)])
        of_zero = bounds == 0.0
        sizes = bounds + of_zero
        senses = np.array([self.sense, *(limit.sense for limit in self.limits)]) * np.sign(sizes)
        ratios = np.array(values) / sizes + of_zero
        place = np.where(of_zero, 1.0, np.maximum(ratios, LINEAR))
        return senses * (np.log(place) + (ratios - place) / place), senses / place / sizes

    def keeps(self, readings: Sequence[Reading]) -> bool:
        """Whether all limits are satisfied; `readings`: objective, limits, and possibly more."""
        return self.violation(readings) <= KEPT

    def violation(self, readings: Sequence[Reading]) -> float:
        """Return the largest excess, relative to its limit; 0 if none is exceeded."""
        excesses = (limit.excess(one.value) for limit, one in zip(self.limits, readings[1:], strict=False))
        return max((0.0, *excesses))


def read_problem(minimise: str | None, maximise: str | None, subject_to: Sequence[str]) -> DesignProblem:
    """Return the problem of an objective and limits as text. Raises `InputError` unless there is one objective."""
    if (minimise is None) == (maximise is None):
        objectives = "both" if minimise is not None else "none"
        raise InputError("optimise: expected one objective, --minimise RESPONSE or --maximise RESPONSE", objectives)
    sense, option, text = (-1.0, "--maximise", maximise or "") if minimise is None else (1.0, "--minimise", minimise)
    return DesignProblem(parse_response(text, option), sense, tuple(map(parse_limit, subject_to)))


def with_motors(problem: DesignProblem, space: DesignSpace) -> DesignProblem:
    """Add the motors' limits as constraints where variables are motor data, unless the user gave other limits."""
    chosen = tuple(variable for variable in space.variables if variable.motors)

    def bound(response: Response) -> Response:
        return replace(response, chosen=chosen) if isinstance(response, OfMotors) else response

    limits = tuple(replace(limit, response=bound(limit.response)) for limit in problem.limits)
    if chosen and not any(isinstance(limit.response, OfMotors) and limit.response.what == "share" for limit in limits):
        limits += (Limit(OfMotors("share", "motors share", chosen), 1.0, 1.0),)
    return replace(problem, objective=bound(problem.objective), limits=limits)


def parse_limit(text: str) -> Limit:
    """Return the limit that `text` states, such as `peak joints.elbow.moment <= 20`. Raises `InputError`."""
    with suppress(ValueError):
        if (match := LIMIT.fullmatch(text.strip())) and np.isfinite(bound := float(match["bound"])):
            sense = 1.0 if match["sense"] == "<=" else -1.0
            return Limit(parse_response(match["response"], "--subject-to"), sense, bound)
    raise InputError(
        '--subject-to: expected "RESPONSE <= NUMBER" or "RESPONSE >= NUMBER", such as "peak joints.elbow.moment <= 20"',
        f'"{shown(text)}"',
    )
