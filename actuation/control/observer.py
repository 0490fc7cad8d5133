"""Observers: estimates of what no sensor reads, by a sampled model of the robot about its reference. SI units.

As an `Observer` a Kalman filter has M = 0 and, in its steady state, L = P Cᵀ (C P Cᵀ + R)⁻¹ with P from a Riccati
equation (Anderson and Moore, Optimal Filtering, 1979, ch. 4); a predictor has L = 0. States of the model include known
commands that wait for their delay, and the filters of sensors.
"""

from collections.abc import Mapping, Sequence
from copy import copy
from dataclasses import fields, replace

import numpy as np

from ...common.arrays import Array, ComplexArray
from ...common.errors import InputError, SolveError, quoted
from ...common.libraries import scipy
from ...common.structs import struct
from ..context import ActuatedContext
from .controllers import Controller, LinearFeedback, make_controllers
from .linear_model import LinearModel, kept_modes, state_space
from .margins import Feedback
from .reachability import observability
from .records import (
    FilterRecord,
    GainsObserver,
    KalmanObserver,
    KalmanRecord,
    SampledAnalysis,
    ScheduledObserver,
    Sensor,
)
from .robot import ControlledRobot, Setup, default_tip, estimated_sensors
from .sampled_model import riccati, sampled, zero_order_hold
from .signals import Signal, filters, make_signals, merged, readings_at

FAR = 1e9  # times the largest reading off its reference: such estimates diverge
HIDDEN = 1e-7  # of the largest singular value
DECAYS = 1.0 - 1e-10  # eigenvalues of decaying errors; what no sensor sees is at 1, to round-off
NAMED = 0.1  # of the largest entry of a vector of states


@struct
class Observer:
    """Matrices of an observer with n states for p readings y: x̂ = x̂⁻ + L (y − C x̂⁻), estimates E x̂; SI units.

    The next prediction x̂⁻ is A x̂ + B u + M (y − C x̂⁻) with commands u; y and u are deviations from the reference.
    """

    A: Array  # (n, n)
    B: Array  # (n, inputs)
    C: Array  # (p, n)
    L: Array  # (n, p)
    M: Array  # (n, p)
    E: Array  # (estimates, n)
    covariance: Array  # (n, n) of x − x̂; nan where the noise is not known
    estimates: tuple[str, ...]  # names

    @property
    def error(self) -> Array:
        """Matrix F (n, n), SI, of the estimation error x − x̂⁻ from sample to sample."""
        return self.A - (self.A @ self.L + self.M) @ self.C

    @property
    def radius(self) -> float:
        """Spectral radius of `error`: below 1, estimation errors decay from sample to sample."""
        return float(np.abs(np.linalg.eigvals(self.error)).max(initial=0.0))

    def towards(self, other: "Observer", part: float) -> "Observer":
        """The observer with all matrices interpolated: `part` 0 is this one, 1 the other."""
        names = [each.name for each in fields(self) if each.name != "estimates"]
        mixed = {name: (1 - part) * getattr(self, name) + part * getattr(other, name) for name in names}
        return replace(self, **mixed)

    def closed(self, inner: Feedback) -> Feedback:
        """Observer and controllers `inner` on readings and estimates as one law from readings to commands.

        Limits of commands are left out.
        """
        p, c = len(self.C), len(inner.A)
        unit, none = np.eye(p), np.zeros((p, len(self.A)))
        # readings and estimates by x̂⁻ and y
        by_x, by_y = np.vstack([none, self.E - self.E @ self.L @ self.C]), np.vstack([unit, self.E @ self.L])
        u_x, u_y = inner.D @ by_x, inner.D @ by_y
        A = np.block([[self.error + self.B @ u_x, self.B @ inner.C], [inner.B @ by_x, inner.A]])
        B = np.vstack([self.A @ self.L + self.M + self.B @ u_y, inner.B @ by_y])
        return Feedback(A.reshape(len(A), len(self.A) + c), B, np.hstack([u_x, inner.C]), u_y,
                        inner.inputs, inner.outputs[:p])  # fmt: skip


def kalman(
    record: FilterRecord,
    model: LinearModel,
    read: Sequence[Signal],
    estimated: Sequence[str],
    sampling: tuple[Sequence[str], float, float],
) -> Observer:
    """The steady-state Kalman filter of a model that has the signals `read` and `estimated` as outputs.

    `sampling`: names of commands, sample time and delay (s). Raises `InputError` for sensors without noise, for noise
    that acts on no input of the model, and for motions that do not decay and that no sensor sees.
    """
    inputs, T, delay = sampling
    names = [signal.name for signal in read]
    exact = [s.name for s in read if not (s.sensor.deviation(T) or s.sensor.resolution)]
    if exact or not read:
        raise InputError(
            "expected sensors with noise, noise_density or resolution, found"
            + (f" none of these of {quoted(exact)}" if exact else " no sensor")
        )
    rows, columns = model.outputs(names), model.inputs(inputs)
    added, process = model.inputs(list(record.disturbance)), model.inputs(list(record.process))
    n, d = len(model.A), len(added)
    A = np.zeros((n + d, n + d))
    A[:n, :n], A[:n, n:] = model.A, model.B[:, added]
    B = np.vstack([model.B, np.zeros((d, model.B.shape[1]))])
    felt = model.D[rows]
    plant = sampled(A, B[:, columns], T, delay, with_last=bool(felt.any()))
    sizes, at = np.array(list(record.process.values())), len(plant.A)
    w = len(process) if felt[:, process].any() else 0  # loads that readings feel, the last ones, of unit variance
    seen = np.zeros((len(rows), at + w))
    seen[:, :n], seen[:, n : n + d] = model.C[rows], felt[:, added]
    if felt.any():
        seen[:, n + d : n + d + len(columns)] = felt[:, columns]
    seen[:, at:] = (felt[:, process] * sizes)[:, :w]
    A_w, B_w, C_w, D_w = filters(read, T)
    A = np.block([
        [plant.A, np.zeros((at, w + len(A_w)))], [np.zeros((w, at + w + len(A_w)))], [B_w @ seen, A_w]
    ])  # fmt: skip
    C = np.hstack([D_w @ seen, C_w])
    unknown = np.r_[: n + d, at : len(A)]  # commands on their way are known
    pushed = np.zeros((len(A), len(process)))
    pushed[:n] = zero_order_hold(model.A, model.B[:, process], T)[1] * sizes
    pushed[at : at + w] = np.eye(len(process))[:w]
    Q = pushed @ pushed.T
    Q[range(n, n + d), range(n, n + d)] = np.square(list(record.disturbance.values())) * T
    R = np.array([s.sensor.deviation(T) ** 2 + s.sensor.resolution**2 / 12 for s in read])
    a, c, q = A[np.ix_(unknown, unknown)], C[:, unknown], Q[np.ix_(unknown, unknown)]
    disturbed = [f"disturbance/{name}" for name in record.disturbance]
    states = [*model.state_names, *disturbed, *list(record.process)[:w]]
    states += [f"filter {k}" for k in range(1, len(A_w) + 1)]
    P = _covariance(a, c, q, R, states)
    L = np.zeros((len(A), len(rows)))
    L[unknown] = np.linalg.solve(c @ P @ c.T + np.diag(R), c @ P).T
    covariance = np.zeros_like(A)
    covariance[np.ix_(unknown, unknown)] = P - L[unknown] @ c @ P
    E = np.zeros((len(estimated) + d, len(A)))
    E[: len(estimated), :n] = model.C[model.outputs(estimated)]
    E[len(estimated) :, n : n + d] = np.eye(d)
    B = np.vstack([plant.B, np.zeros((len(A) - at, len(columns)))])
    M = np.zeros_like(L)
    return Observer(A=A, B=B, C=C, L=L, M=M, E=E, covariance=covariance, estimates=(*estimated, *disturbed))


def _covariance(A: Array, C: Array, Q: Array, R: Array, states: Sequence[str]) -> Array:
    """P of x − x̂⁻ in the steady state. Raises `InputError` where there is none."""
    try:
        return riccati(A.T, C.T, Q, np.diag(R), DECAYS)
    except ValueError as error:
        unseen, still = hidden(A, C, states), hidden(A.T, Q, states)
        if not unseen and not still:
            raise InputError(
                "expected noise with which the Riccati equation has a solution to round-off",
                f"sensors far more exact than `process` moves the robot? ({' '.join(str(error).split())})",
            ) from None
        why = f"they cannot see {', '.join(unseen)}" if unseen else f"`process` does not reach {', '.join(still)}"
        raise InputError(f"expected sensors that see every motion that does not decay, found: {why}") from None


def hidden(A: Array, C: Array, names: Sequence[str]) -> list[str]:
    """`names` of the n states of x(k+1) = A x in motions that do not decay and that readings C x do not show.

    A is (n, n), C (p, n), in any units. By the Popov–Belevitch–Hautus test.
    """
    found: dict[str, None] = {}
    A, (scale, _) = scipy.linalg.matrix_balance(A, permute=False, separate=True)
    C = C * scale
    size = np.linalg.norm(C, axis=1, keepdims=True)
    C = C / np.where(size > 0.0, size, 1.0)
    for value in np.linalg.eigvals(A):
        if abs(value) >= 1.0 - HIDDEN:
            _, sizes, V = np.linalg.svd(np.vstack([A - value * np.eye(len(A)), C]))
            if sizes[-1] < HIDDEN * sizes[0]:
                vector = np.abs(V[-1])
                found |= dict.fromkeys(names[k] for k in np.flatnonzero(vector > NAMED * vector.max()))
    return list(found)


def given(record: GainsObserver, setup: Setup) -> Observer:
    """The observer with the scene's matrices. Raises `InputError` where they do not fit, or let errors grow."""
    A, B, C, gain = (np.atleast_2d(np.array(of, dtype=float)) for of in record.matrices)
    n, m, p = len(A), len(record.inputs), len(record.outputs)
    for name, of, size in (("A", A, (n, n)), ("B", B, (n, m)), ("C", C, (p, n)), ("gain", gain, (n, p))):
        if of.shape != size:
            raise InputError(
                f"expected {name} with {size[0]} × {size[1]} numbers ({n} states, {m} inputs, {p} outputs)",
                f"{of.shape[0]} × {of.shape[1]}",
            )
    scale = np.array(record.scale or (1.0,) * p)
    if len(scale) != p or not scale.all():
        raise InputError(f"expected {p} numbers other than 0 as scale, one of each output", f"{scale}")
    rows, columns = setup.columns(*record.outputs), setup.places(*record.inputs)
    C_all, M = np.zeros((len(setup.outputs), n)), np.zeros((n, len(setup.outputs)))
    B_all = np.zeros((n, len(setup.inputs)))
    C_all[rows], M[:, rows], B_all[:, columns] = C / scale[:, None], gain * scale, B
    observer = Observer(
        A=A,
        B=B_all,
        C=C_all,
        L=np.zeros_like(M),
        M=M,
        E=np.vstack([C / scale[:, None], np.eye(n)]),
        covariance=np.full((n, n), np.nan),
        estimates=(*record.outputs, *(f"state/{k}" for k in range(1, n + 1))),
    )
    if observer.radius >= 1.0:
        raise InputError("expected eigenvalues of A − gain C below 1 in size", f"{observer.radius:.6g}")
    return observer


@struct
class Schedule:
    """Observers at times (N,), s, of the path; their matrices are interpolated linearly in between."""

    times: Array
    observers: tuple[Observer, ...]

    def at(self, t: float) -> Observer:
        """The observer at t (s), interpolated; outside the times, the nearest one."""
        if len(self.times) == 1:
            return self.observers[0]
        k = int(np.clip(np.searchsorted(self.times, t) - 1, 0, len(self.times) - 2))
        part = (t - self.times[k]) / (self.times[k + 1] - self.times[k])
        return self.observers[k].towards(self.observers[k + 1], float(np.clip(part, 0.0, 1.0)))

    @property
    def radius(self) -> float:
        """Largest spectral radius of the estimation error at the times and half way between."""
        halves = (self.times[1:] + self.times[:-1]) / 2
        return max(self.at(float(t)).radius for t in np.concatenate([self.times, halves]))


@struct
class Estimates:
    """Estimates at K samples, and tip error against the true motion."""

    names: tuple[str, ...]
    values: Array  # (K, names) estimates, SI units
    tip: str  # point "BODY.POINT"
    position: Array  # (K, d) m, estimated position of the tip
    error: Array  # (K,) m, distance of this from the true position
    sigma: Array  # (K, d) m, standard deviations by the covariance of the filter
    # mean of eᵀ Σ⁻¹ e over the number of axes, e the error of the position; 1 if the covariance Σ is right
    nees: float
    inside: float  # part of the errors within ±2σ, 0.95 if the covariance is right
    poles: ComplexArray  # (n,) eigenvalues, no unit, of the estimation error, from sample to sample, at the start


class Observed:
    """An observer and its controllers, which the loop calls as one controller; SI units.

    `setup`: that of the controllers, with estimates after the p readings. `origin`: readings (K, p) and commands
    (K, inputs) about which the model is linear. `ranges` (2, inputs): limits of the commands that the observer knows.
    """

    def __init__(
        self,
        schedule: Schedule,
        setup: Setup,
        controllers: Sequence[Controller],
        *,
        ranges: Array,
        origin: tuple[Array, Array],
        settle: int,
        tip: str,
        warnings: Sequence[str],
    ) -> None:
        self.schedule, self.setup, self.controllers = schedule, setup, controllers
        self._range, self._settle, self.tip = ranges, settle, tip
        self._origin, self._nominal = origin
        self.bandwidth = max((each.bandwidth for each in controllers), default=0.0)
        self.warnings = [*warnings, *(line for each in controllers for line in getattr(each, "warnings", ()))]
        first = schedule.observers[0]
        self._p, self._x = len(first.C), np.zeros(len(first.A))
        self.estimates = np.zeros((len(setup.times), len(setup.outputs) - self._p))  # at samples

    def __call__(self, k: int, y: Array) -> Array:
        """Commands at sample k. Raises `SolveError` where estimates diverge."""
        for _ in range(self._settle if k == 0 else 0):
            self._step(k, y)
        return self._step(k, y)

    def _step(self, k: int, y: Array) -> Array:
        setup, observer = self.setup, self.schedule.at(float(self.setup.times[k]))
        innovation = y - self._origin[k] - observer.C @ self._x
        x = self._x + observer.L @ innovation
        seen = np.concatenate([y, setup.reference[k, self._p :] + observer.E @ x])
        self.estimates[k] = seen[self._p :]
        u: Array = np.zeros(len(setup.inputs))
        for controller in self.controllers:
            u += controller(k, seen)
        command = np.minimum(np.maximum(setup.feed_forward[k] + u, self._range[0]), self._range[1])
        self._x = observer.A @ x + observer.B @ (command - self._nominal[k]) + observer.M @ innovation
        if not np.abs(seen).max(initial=0.0) < FAR * (1.0 + np.abs(y).max(initial=0.0)):
            raise SolveError(
                f"observer: the estimate diverges at t = {setup.times[k]:g} s: the model about the"
                " reference does not fit the motion; gains along the path, or sensors that see more, may"
            )
        return u

    def __copy__(self) -> "Observed":
        """Make a copy with controllers as at the start of a run."""
        found = object.__new__(Observed)
        vars(found).update(vars(self), controllers=[copy(each) for each in self.controllers])
        return found

    def record(self, truth: Mapping[str, Array]) -> Estimates:
        """The estimates at the samples taken, compared with the true values (taken,), SI units, by name."""
        p, tip = self._p, self.tip
        taken = len(next(iter(truth.values())))
        values, times = self.estimates[:taken], self.setup.times[:taken]
        names = [name.removeprefix("estimate/") for name in self.setup.outputs[p:]]
        columns = [k for k, name in enumerate(names) if name.rpartition("/")[0] == f"point/{tip}"]
        error = values[:, columns] - np.transpose([truth[names[k]] for k in columns] or np.zeros((0, taken)))
        covariance = np.array([
            (of.E[columns] @ of.covariance @ of.E[columns].T).ravel() for of in self.schedule.observers
        ])  # fmt: skip
        around = [np.interp(times, self.schedule.times, of) for of in covariance.T]
        spread = np.reshape(np.transpose(around), (taken, len(columns), len(columns)))
        sigma = np.sqrt(np.einsum("tii->ti", spread).clip(min=0.0))
        moving = [k for k in range(len(columns)) if sigma[:, k].min(initial=np.inf) > 0.0]
        nees = inside = np.nan
        if moving:
            e = error[:, moving]
            weighed = np.linalg.pinv(spread[:, moving][:, :, moving], rcond=HIDDEN, hermitian=True) @ e[..., None]
            sizes = np.linalg.eigvalsh(spread[0][np.ix_(moving, moving)])
            rank = int(np.count_nonzero(sizes > HIDDEN * sizes[-1]))
            nees = float(np.einsum("ti,tij->t", e, weighed).mean() / rank)
            inside = float((np.abs(e) <= 2 * sigma[:, moving]).mean())
        return Estimates(
            names=tuple(names),
            values=values,
            tip=tip,
            position=values[:, columns],
            error=np.linalg.norm(error, axis=1),
            sigma=sigma,
            nees=nees,
            inside=inside,
            poles=np.linalg.eigvals(self.schedule.observers[0].error).astype(complex),
        )


def model_of_filter(record: FilterRecord, robot: ControlledRobot, row: int, signals: Sequence[Signal]) -> LinearModel:
    """The linear model of a filter about output no. `row` of the robot's motion, with outputs `signals`.

    Its links have their lowest modes alone; forces that `record` names are inputs, too.
    """
    mechanism = kept_modes(robot.linear(row, record.points), record.modes)
    return state_space(mechanism, readings_at(robot.plant, mechanism, signals))


def kalman_filters(
    record: KalmanObserver | ScheduledObserver,
    context: ActuatedContext,
    setup: Setup,
    sensors: Sequence[Sensor],
    more: Sequence[Sensor],
) -> tuple[Schedule, list[str]]:
    """Filters along the path that estimate readings of `more`, and warnings of modes that `sensors` cannot see.

    Raises `InputError` where no filter exists: see `kalman`.
    """
    robot, T = setup.robot, setup.sample_time
    source = robot.source
    read, estimated = (make_signals(robot.plant, context, of) for of in (sensors, more))
    wanted = merged(estimated, ())
    names, signals = [signal.name for signal in wanted], (*read, *wanted)
    at = [record.time] if isinstance(record, KalmanObserver) else np.linspace(0, source.time[-1], record.count)
    instants = sorted({int(np.abs(source.time - t).argmin()) for t in at})
    filters_there, unseen = [], dict[str, None]()
    for row in instants:
        model = model_of_filter(record, robot, row, signals)
        filters_there.append(kalman(record, model, read, names, (setup.inputs, T, setup.delay)))
        if lost := observability(model, [signal.name for signal in read]).lost:
            unseen[f"observer: sensors cannot see {', '.join(lost)}"] = None
    return Schedule(source.time[instants], tuple(filters_there)), list(unseen)


def make_observed(
    analysis: SampledAnalysis, context: ActuatedContext, setup: Setup, reference: Array, ranges: Array, nominal: Array
) -> Observed:
    """Make the observer with the controllers that act on its estimates.

    On the reference: true values `reference` (K, estimates), commands `nominal` (K, inputs); `ranges` (2, inputs):
    limits of commands; SI units. Raises `InputError` where the observer does not fit the robot.
    """
    record, robot = analysis.observer, setup.robot
    tip, origin = analysis.tip or default_tip(robot.model), setup.reference
    assert record is not None
    if record.about == "zero":
        origin, nominal, reference = (np.zeros_like(of) for of in (origin, nominal, reference))
    unseen: list[str] = []
    try:
        if isinstance(record, KalmanRecord):
            sensors = analysis.sensor, tuple(estimated_sensors(robot, analysis.controller, tip))
            schedule, unseen = kalman_filters(record, context, setup, *sensors)
        else:
            assert isinstance(record, GainsObserver)
            schedule = Schedule(np.zeros(1), (given(record, setup),))
            reference = origin[:, setup.columns(*record.outputs)]
        if (radius := schedule.radius) >= 1.0:
            raise InputError("expected errors that die out along the path", f"|eigenvalue| = {radius:.6g}")
    except InputError as error:
        raise InputError(f"observer: {str(error).removeprefix('controller: ')}") from None
    every = schedule.observers[0].estimates
    still = np.zeros((len(reference), len(every) - reference.shape[1]))
    inner = replace(
        setup,
        outputs=(*setup.outputs, *(f"estimate/{name}" for name in every)),
        reference=np.hstack([setup.reference, reference, still]),
    )
    acting = make_controllers(analysis.controller, inner)
    if isinstance(record, KalmanRecord) and record.reject:
        own = [name for name in record.disturbance if name in setup.inputs]
        P = np.zeros((len(inner.inputs), len(inner.outputs)))
        P[inner.places(*own), inner.columns(*(f"estimate/disturbance/{name}" for name in own))] = 1.0
        acting.append(LinearFeedback(inner, P))
    return Observed(
        schedule, inner, acting, ranges=ranges, origin=(origin, nominal), settle=record.settle, tip=tip, warnings=unseen
    )
