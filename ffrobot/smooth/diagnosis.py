"""What makes a robot vibrate under a stream of set points: faults of the stream, or what it excites, joint by joint."""

from collections.abc import Iterator, Sequence

import numpy as np

from ..common.arrays import Array
from ..common.libraries import scipy
from ..common.structs import struct
from ..mbs.fields.paths import Piecewise
from .recording import Fault, Limits, Recording, evened, faults_of_motion, faults_of_stamps, peaks
from .robot import Modes, Ride, Robot, accelerations

KEPT = 3  # frequencies
POINTS = 10  # set points in a period of the lowest frequency: fewer are coarse
NEAR, PEAK = 0.1, 3.0  # of a frequency, and times the usual of the spectrum about it: the command oscillates there
ABOUT, GRID = (0.3, 3.0), 400  # times the lowest frequency: the spectrum that is usual, and in how many points
CAUSES = ("jitter", "jump", "noise", "gap", "coarse", "resonance")
"""Kinds of faults by which a stream excites vibrations, by their beginnings."""


@struct
class Diagnosis:
    """Diagnosis of a stream of set points for n joints of a robot."""

    # the stream, and the simulated motion under it
    recording: Recording
    ride: Ride
    # simulated motion under the same set points at even times; `ride` where these are no smoother
    even: Ride
    faults: tuple[Fault, ...]  # of the stream
    # small vibrations in postures along the motion, the last one at rest, with motors locked
    modes: Sequence[Modes]
    frequencies: Array  # (postures, k) Hz, the lowest of these modes
    # (n,) m peak to peak, the most that each joint alone leaves as residual vibration at the point: the sum over all
    # modes of the linear model at the end
    alone: Array
    shares: Array  # (n,) of each joint in the vibration, in phase with the whole; they add up to 1
    by_mode: Array  # (k,) m peak to peak, residual vibration by all joints at each frequency
    # (1 + n, F) frequencies, Hz, and |∫ θ̈ e^(−iωt) dt| of motors' accelerations θ̈, rad/s or m/s
    spectrum: Array
    peaks: Array  # (3, n) largest speed, acceleration and jerk, in rad or m, and s

    @property
    def residual(self) -> float:
        """Residual vibration at the point, m, peak to peak; 0 where nothing vibrates."""
        settling = self.ride.settling
        return 0.0 if settling is None or not self.frequencies.size else settling.residual

    def verdict(self, robot: Robot) -> str:
        """Return a sentence on the vibration and its cause."""
        kinds = list(dict.fromkeys(fault.kind for fault in self.faults))
        causes = [kind for kind in kinds if kind.startswith(CAUSES)]
        if not self.frequencies.size:
            return "nothing vibrates in the model: its links and gears are rigid. Gears with stiffness do"
        if self.ride.settling is None:
            return "the robot has no place of rest at the end of the motion: joints without motors are free"
        if self.residual <= robot.tolerance:
            what = f"{robot.point} vibrates by {1e3 * self.residual:.2g} mm at most"
            stream = f". Faults of the stream: {', '.join(kinds)}" if kinds else ", and the stream has no fault"
            return f"not vibration of the robot: {what}{stream}"
        worst, share = int(self.shares.argmax()), 100 * self.shares.max()
        others = f", other joints take {share - 100:.0f} % away" if round(share) > 100 else ""
        frequency = self.frequencies[-1, int(self.by_mode.argmax())]
        why = f"faults of the stream ({', '.join(causes)})" if causes else "the motion, without a fault of the stream"
        even = ""
        if self.even is not self.ride and self.even.settling is not None:
            even = f". Sent at even times, the same set points leave {1e3 * self.even.settling.residual:.3g} mm"
        return (
            f"vibration of the robot: {robot.point} swings by {1e3 * self.residual:.3g} mm peak to peak after the last"
            f" set point, at {frequency:.3g} Hz, excited by {why}; {robot.joints[worst]} causes"
            f" {share:.0f} %{others}{even}"
        )


def diagnose(robot: Robot, recording: Recording, limits: Limits) -> Diagnosis:
    """Simulate the robot under the stream as it is, and find its faults. Raises `SolveError` if it cannot follow."""
    times, command = recording.dense(min(recording.step / 4, 1e-3))
    ride = robot.ride(times, command)
    path, modes, even = robot.servo.motors(times, command), modes_along(robot, ride), evened(recording)
    kept = min(KEPT, *(len(one.omega) for one in modes))
    frequencies = np.array([one.omega[:kept] for one in modes]) / (2 * np.pi)
    left = modes[-1].left(*accelerations(path))
    whole = left.sum(axis=1)
    in_phase = (whole.conj() @ left).real
    grid = np.linspace(0.0, ABOUT[1] * (frequencies[:, 0].max() if kept else 10.0), GRID)
    spectrum = _spectrum(path, grid)
    faults = [*faults_of_stamps(recording), *faults_of_motion(recording, limits, ride.torque)]
    if kept:
        of_even = spectrum if even is recording else _spectrum(robot.servo.motors(even.times, even.values), grid)
        step, lowest = recording.step, frequencies[:, 0].min()
        if recording.rates is None and step * lowest > 1 / POINTS:
            text = (
                f"a set point every {1e3 * step:.3g} ms, {1 / (step * lowest):.2g} in a period of the lowest frequency,"
                f" {lowest:.3g} Hz: the lines between them are felt. Expected {POINTS} at least"
            )
            faults.append(Fault("coarse sampling", text))
        faults += _resonance(robot, frequencies, grid, of_even)
    return Diagnosis(
        recording=recording,
        ride=ride,
        even=ride if even is recording else robot.ride(*even.dense(min(even.step / 4, 1e-3))),
        faults=tuple(faults),
        modes=modes,
        frequencies=frequencies,
        alone=2 * np.abs(left).sum(axis=0),
        shares=in_phase / (in_phase.sum() or 1.0),
        by_mode=2 * np.abs(whole)[:kept],
        spectrum=np.vstack([grid, spectrum.T]),
        peaks=peaks(*recording.dense(recording.step / 4)),
    )


def modes_along(robot: Robot, ride: Ride, *, of_links: bool = False) -> list[Modes]:
    """Return modes at the postures of `ride`, the last one at rest; `of_links`: motors and joints move alike."""
    return [robot.modes(q, of_links=of_links) for q in ride.postures]


def _spectrum(path: Piecewise, frequencies: Array) -> Array:
    """(F, n) |∫ θ̈ e^(−iωt) dt| of motors, rad/s, at even frequencies (F,), Hz, from 0."""
    fine, of_motors = accelerations(path)
    turn = np.exp(-2j * np.pi * frequencies[1] * fine[1])
    return np.abs(scipy.signal.czt(of_motors, len(frequencies), turn, axis=0)) * fine[1]


def _resonance(robot: Robot, frequencies: Array, grid: Array, spectrum: Array) -> Iterator[Fault]:
    """Where the command of a joint oscillates at a natural frequency: a peak of its spectrum there."""
    for of in frequencies.T:
        near = (grid >= (1 - NEAR) * of.min()) & (grid <= (1 + NEAR) * of.max())
        about = (grid >= ABOUT[0] * of.min()) & (grid <= ABOUT[1] * of.max()) & ~near
        if not near.any() or not about.any():
            continue
        for joint, values in zip(robot.joints, spectrum.T, strict=True):
            k = int(np.where(near, values, 0.0).argmax())
            inside = 0 < k < len(grid) - 1 and values[k] >= max(values[k - 1], values[k + 1])
            if inside and values[k] > PEAK * np.median(values[about]) and values[k] > values[about].max() / 2:
                yield Fault(
                    "resonance", f"{joint}: the command oscillates at {grid[k]:.3g} Hz, where the robot has a natural"
                    f" frequency of {of.min():.3g} to {of.max():.3g} Hz",
                )  # fmt: skip
