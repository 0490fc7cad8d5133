"""A robot whose motors follow set points: its vibrations in the postures of a motion, and what is left at its tool."""

from dataclasses import replace

import numpy as np

from ..common.arrays import Array, ComplexArray
from ..common.structs import struct
from ..map.pose_map import check_point, default_point
from ..mbs.analysis.pcid import Pcid
from ..mbs.fields.paths import Piecewise
from ..mbs.linear.joint_conditions import COMPLIANT, LOCKED, free_coordinates
from ..mbs.linear.linearisation import LinearEquations
from ..mbs.model.gears import with_compliance
from ..mbs.quantities.motion import section_motion
from ..mbs.quantities.settling import Settling, commanded_rest, settling
from ..mbs.quantities.supply import gear_motions, motor_moments
from ..mbs.run.record import Run
from ..mbs.scene.space import SPACES
from ..mbs.scene.trajectories import Trajectory
from ..run.prepare import prepare_scene, unsolved
from ..run.solve import run_analyses
from ..run.watcher import Watcher
from ..scene.scene import Scene
from .recording import coordinates
from .servo import Servo

RUN = "motion"
TOLERANCE = 1e-7  # of the integration
PER_PERIOD = 40  # outputs, of the lowest vibration
LAST, LONGEST = 20.0, 2.0  # periods of the lowest vibration after the motion, and s at most
ROUND_OFF = 1e-9  # of the number of outputs
SLACK = 1e-9  # of the largest stiffness: less is none
UNKNOWN = 5.0  # Hz, where nothing vibrates
FIRST = 1e-3  # s, of a run that finds the posture at the start
FINE, EVERY = 4000, 5e-4  # instants of motors' accelerations at least, and s between them at most
INSTANTS = 9  # postures along the motion whose frequencies are found


def accelerations(path: Piecewise) -> tuple[Array, Array]:
    """Return times (T,), s, to the end of the `path` of n motors, and their accelerations (T, n), rad/s² or m/s²."""
    fine = np.linspace(0.0, path.end, max(FINE, int(path.end / EVERY) + 2))
    return fine, path.sample(fine, 2)


@struct
class Modes:
    """Small vibrations of the robot at one posture with its motors at rest, the slowest first: k of them."""

    # (k,) rad/s, and damping ratios
    omega: Array
    ratio: Array
    # (k, n) acceleration of `Robot.point` in each mode's direction, by each motor's: m/s² per rad/s² or m/s²
    driven: Array

    def left(self, times: Array, accelerations: Array) -> ComplexArray:
        """Complex amplitudes (k, n), m, of each mode by each motor at the last of `times` (T,), s.

        They are at `Robot.point`, in the mode's direction. Motors have `accelerations` (T, n), rad/s² or m/s².
        """
        poles = self.omega * (-self.ratio + 1j * np.sqrt(1.0 - self.ratio**2))
        widths = (np.append(0.0, np.diff(times)) + np.append(np.diff(times), 0.0)) / 2
        integral = (np.exp(np.outer(poles, times[-1] - times)) * widths) @ accelerations
        return np.asarray(self.driven / poles.imag[:, None] * integral)


@struct
class Ride:
    """Simulated motion of the robot under one stream of set points."""

    # of the point, by its distance from its final place since the last set point; its residual is that of the first
    # period of the lowest vibration once the controllers have settled. None without a place of rest
    settling: Settling | None
    # (T,) s, and distance of the point from its final place, m
    times: Array
    off: Array
    # (`INSTANTS`, n_q) coordinates, rad and m, evenly up to the last set point; the last is that of rest
    postures: Array
    torque: Array  # (n,) largest of each motor, N·m or N
    # (2, n) by which joints are off their set points at rest, at the start and at the end, rad or m
    sag: Array


class Robot:
    """A scene's robot, whose joints with motors, in the scene's order, follow set points by the controllers `servo`.

    `point` "BODY.POINT" is where vibration counts (None: `default_point`), `tolerance`, m, that of its final place.
    """

    def __init__(self, scene: Scene, servo: Servo, point: str | None, tolerance: float, watcher: Watcher) -> None:
        self.file, self.servo, self.tolerance, self._watcher = scene.path, servo, tolerance, watcher
        self.joints = tuple(joint.name for joint in scene.motor_joints)
        self._units = dict.fromkeys(joint.units[0] for joint in scene.motor_joints)
        update = {"trajectory": (), "analysis": (), "initial": scene.initial.model_copy(update={"state": "static"})}
        self._scene = scene.model_copy(update=update)
        self._prepared = prepare_scene(self._scene, watcher)
        self.point = point or default_point(scene)
        check_point(self._prepared, self.point)
        self._gears = with_compliance(self._prepared.model.without_paths())
        self.has_gears, self._still = bool(self._gears.tree.gears), np.zeros(self._gears.tree.n_v)
        self.bends = not self._gears.tree.is_rigid
        self._frequency: float | None = None

    def units(self, per: str = "") -> str:
        """Return units of the joints' coordinates, or of rates with `per`, such as "/s"."""
        return ", ".join(f"{unit}{per}" for unit in self._units)

    def modes(self, q: Array, *, of_links: bool = False) -> Modes:
        """Return modes at the posture q (n_q,), rad and m; `of_links`: motors and joints behind gears move alike."""
        mechanism = self._linear.at(0.0, q, self._still, self._still)
        sides = ("joint", "motor") if of_links else ("motor",)
        free = free_coordinates(mechanism, LOCKED if of_links or not self.has_gears else COMPLIANT)
        squares, vectors = np.linalg.eigh((free.K + free.K.T) / 2)
        stiff = squares > SLACK * squares.max(initial=0.0)
        omega, shape = np.sqrt(squares[stiff]), vectors[:, stiff]
        outputs = mechanism.outputs
        moved = [outputs.get(f"{side}/{joint}", outputs[f"joint/{joint}"]) for side in sides for joint in self.joints]
        follow = np.linalg.pinv(np.array(moved)) @ np.tile(np.eye(len(self.joints)), (len(sides), 1))
        slack = shape @ ((shape.T @ free.N.T @ mechanism.K @ follow) / squares[stiff, None])
        driven = -shape.T @ free.N.T @ mechanism.M @ (follow - free.N @ slack)
        J = mechanism.points[self.point][: len(SPACES[self._scene.space].translations)] @ free.N @ shape
        ratio = np.einsum("in,ij,jn->n", shape, free.D, shape) / (2 * omega)
        return Modes(omega, ratio, np.linalg.norm(J, axis=0)[:, None] * driven)

    def ride(self, times: Array, command: Array) -> Ride:
        """Simulate set points (T, n), rad or m, at `times` (T,), s, from rest; joints without motor move freely.

        Raises `SolveError` where the motion cannot be followed.
        """
        path, last = self.servo.motors(times, command), float(times[-1])
        period = 1 / self._lowest(path)
        until = path.end + period
        run = self._solved(path, until + min(LAST * period, LONGEST), period / PER_PERIOD)
        rest, moments = commanded_rest(run, last), motor_moments(run)
        torque = np.array([np.abs(moments[joint]).max() if joint in moments else 0.0 for joint in self.joints])
        postures = run.q[np.searchsorted(run.time, np.linspace(0.0, last, INSTANTS))]
        if rest is None:
            return Ride(None, run.time, np.full(len(run.time), np.nan), postures, torque, np.zeros((2, len(torque))))
        postures[-1] = rest.q
        whole, soon = (
            settling(one, rest, [self.point], self.tolerance, rest.frequency)[self.point]
            for one in (run, run.at(np.flatnonzero(run.time <= until).tolist()))
        )
        still = replace(run, model=rest.model, q=rest.q[None], v=0 * run.v[:1])
        off = np.linalg.norm(section_motion(run, self.point).r - section_motion(still, self.point).r[0], axis=1)
        places = (coordinates(of, self.joints)[0] for of in (run, still))
        sag = np.array([place - own for place, own in zip(places, command[[0, -1]], strict=True)])
        return Ride(replace(whole, residual=soon.residual), run.time, off, postures, torque, sag)

    def inverted(self, times: Array, motion: Piecewise) -> tuple[Array, Array]:
        """Set points (k, n), rad or m, every `times[1]` s for links to follow `motion`, and motors' torques (N·m, N).

        Motors are ahead by the strain of gears. Set points begin before the motion and end after it by `Servo.margins`.
        """
        run = self._solved(motion, float(times[-1]), float(times[1]), by_joints=True)
        position, rate = motion.sample(times), motion.sample(times, 1)
        moments = np.column_stack([motor_moments(run)[joint] for joint in self.joints])
        for joint, gear in gear_motions(run).items():
            k = self.joints.index(joint)
            position[:, k], rate[:, k] = gear.angle, gear.rate
            moments[[0, -1], k] = gear.gear_moment[[0, -1]]  # at rest; the rotor's acceleration jumps there
        around = (np.ceil(np.array(self.servo.margins) / times[1]).astype(int), (0, 0))
        position, moments = (np.pad(of, around, "edge") for of in (position, moments))
        command = self.servo.command(times[1], position, np.pad(rate, around))
        command[[0, -1]] = position[[0, -1]]  # at rest, whatever derivatives jump there
        return command, moments

    def _lowest(self, path: Piecewise) -> float:
        """Hz, of the posture in which the robot starts."""
        if self._frequency is None:
            q = self._solved(path, FIRST, FIRST).q[0]
            self._linear = LinearEquations(self._gears, q, {self.point: self.point})
            omega = self.modes(q).omega
            self._frequency = float(omega[0]) / (2 * np.pi) if len(omega) else UNKNOWN
        return self._frequency

    def _solved(self, path: Piecewise, end: float, output_step: float, *, by_joints: bool = False) -> Run:
        """The robot whose motors, or joints behind their gears, follow the path, until `end` at least."""
        paths = tuple(
            Trajectory(name=name, value=function, joint=name if by_joints else None, motor=None if by_joints else name)
            for name, function in zip(self.joints, path.functions(), strict=True)
        )
        end = np.ceil(end / output_step * (1 - ROUND_OFF)) * output_step
        analysis = Pcid(name=RUN, kind="pcid", end=end, output_step=output_step, tolerance=TOLERANCE)
        scene = self._scene.model_copy(update={"trajectory": paths, "analysis": (analysis,)})
        run = run_analyses(unsolved(replace(self._prepared, scene=scene)), self._watcher).analyses[RUN].run
        run.check_completed("")
        return run
