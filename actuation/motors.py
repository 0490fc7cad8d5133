"""Requirements on motors over time against their limits: peaks, root mean squares, torques at rest."""

from collections.abc import Mapping
from dataclasses import replace

import numpy as np

from ..common.arrays import Array, Booleans
from ..common.errors import SolveError
from ..common.peaks import largest, root_mean_square, shares
from ..common.structs import struct
from ..mbs._core import TimeFunction
from ..mbs.joints.joint import MotorLimits
from ..mbs.linear.statics import Statics
from ..mbs.model.known_motion import mass_matrices
from ..mbs.model.nodes import rotor
from ..mbs.model.system import MultibodySystem
from ..mbs.quantities.motion import joint_motion
from ..mbs.quantities.supply import actuator_forces, motor_motion
from ..mbs.run.record import Run

NEARBY = 1e-3  # of the path's duration: a jump of the path this near to a peak may have made it
INSTANT = 1e-4  # of the path's duration: over which one-sided derivatives are taken
JUMP = 0.05  # of the largest acceleration or jerk of the path: less is none


@struct
class MotorFeasibility:
    """Requirements on one motor at the joint, and its limits (infinite if none): N·m, rad/s, W; or N, m/s, W."""

    moment: float  # largest absolute value; speed and power likewise
    moment_limit: float
    speed: float
    speed_limit: float
    power: float
    power_limit: float
    saturation_time: float  # when a limit is first exceeded, s; NaN where none is
    # root mean square from t = 0 to the end of the analysis (thermal-equivalent torque)
    rms_moment: float = np.nan  # from here on not in files of version 0.1
    usual_moment: float = np.nan  # not exceeded for 99 % of the time, pre- and post-actuation included
    moment_time: float = np.nan  # when the torque is largest, s
    share_beyond: float = np.nan  # share of the time on the path beyond any limit
    # largest inertia of the robot along the joint, with other joints locked and links rigid, without the rotor, kg·m²
    # (kg); NaN where loops share it among joints
    load_inertia: float = np.nan
    jump: str = ""  # "acceleration" or "jerk" of the path if its jump causes a short peak; else ""
    # largest torque at rest along the path, which a slower path does not reduce; NaN if within the limit, or not known
    static_moment: float = np.nan

    @property
    def factor(self) -> float:
        """Largest ratio of peak torque, speed or power to its limit."""
        return max(self.moment / self.moment_limit, self.speed / self.speed_limit, self.power / self.power_limit)

    @property
    def has_limits(self) -> bool:
        """Whether the motor has a limit."""
        return bool(np.isfinite((self.moment_limit, self.speed_limit, self.power_limit)).any())

    @property
    def has_spike(self) -> bool:
        """Whether the largest torque exceeds that of 99 % of the time by more than a tenth."""
        return self.moment > 1.1 * self.usual_moment

    def spike_in_words(self, unit: str) -> str:
        """Explain a short peak of the torque, in `unit`, and its remedy; empty where there is none."""
        if not self.has_spike:
            return ""
        why = f": the {self.jump} of the path jumps there, so take a smoother path" if self.jump else ""
        or_fewer = " or leave out the highest modes" if self.jump else ""
        return (
            f"the peak at t = {self.moment_time:g} s lasts for less than 1 % of the time, and {self.usual_moment:.4g}"
            f" {unit} are enough for the rest{why}{or_fewer}"
        )


def judge_motors(run: Run) -> dict[str, MotorFeasibility]:
    """The requirements on every motor up to the end of the path, by joint or "JOINT k"."""
    forces, verdicts, end = actuator_forces(run), {}, run.analysis.last_time
    assert forces is not None
    inertias = _load_inertias(run)
    at_rest: Mapping[str, Array] = {}
    for joint in run.model.scene.motor_joints:
        of_joint = joint_motion(run, joint.name)
        assert of_joint is not None
        motor = motor_motion(run, joint.name)
        moments, rates = forces.moments[joint.name], of_joint[1] if motor is None else motor[1][:, None]
        for k, limits in enumerate(joint.motor_limits):
            name = joint.name if len(joint.units) == 1 else f"{joint.name} {k + 1}"
            judged = judge_motion(run.time, moments[:, k], rates[:, k], limits, end)
            jump, static = path_jump(run, judged.moment_time) if judged.has_spike else "", np.nan
            if judged.moment > judged.moment_limit:
                at_rest = at_rest or static_moments(run, end)
                static = float(np.abs(at_rest[joint.name][:, k]).max()) if joint.name in at_rest else static
            inertia = inertias.get(joint.name, (np.nan,) * (k + 1))[k]
            verdicts[name] = replace(judged, jump=jump, load_inertia=inertia, static_moment=static)
    return verdicts


def static_moments(run: Run, end: float) -> Mapping[str, Array]:
    """Motor torques (T, coordinates) by joint, N·m or N, in T ≤ 21 equilibria on a path from t = 0 to `end` (s).

    Empty where there is no equilibrium, or motors do not fit the path.
    """
    on_path = np.flatnonzero((run.time >= 0.0) & (run.time <= end))
    if not len(on_path):
        return {}
    rows = on_path[np.unique(np.linspace(0, len(on_path) - 1, 21).astype(int))]
    time, still = run.time[rows], np.zeros((len(rows), run.model.tree.n_v))
    statics, states, multipliers = Statics(run.model), [], []
    try:
        for t, q in zip(time, run.q[rows], strict=True):
            statics.t = float(t)
            states.append(statics.equilibrium(q))
            multipliers.append(statics.holding_multipliers(states[-1]))
    except SolveError:
        return {}
    at_rest = replace(run, time=time, q=np.array(states), v=still, a=still, multipliers=np.array(multipliers))
    forces = actuator_forces(replace(at_rest, required=None, is_at_rest=True, twists={}, links={}))
    return {} if forces is None else forces.moments


def _load_inertias(run: Run) -> dict[str, tuple[float, ...]]:
    model = run.model
    if model.loop_rows.any() or not len(run.time):
        return {}
    rows = np.unique(np.linspace(0, len(run.time) - 1, 50).astype(int))
    inertia = mass_matrices(MultibodySystem(model), run.q[rows])
    most = inertia.diagonal(axis1=1, axis2=2).max(axis=0)
    inertias, behind = {}, {gear.joint.joint.name: gear.joint.v for gear in model.tree.gears}
    for joint, columns in model.motors.items():
        node = model.tree.nodes[model.tree.carried[joint]]
        J, N = rotor(node)  # 0 of a compliant gear, whose rotor has a coordinate of its own
        inertias[joint] = tuple(float(one) - J * N**2 for one in most[behind.get(joint, columns)])
    return inertias


def judge_motion(time: Array, moment: Array, rate: Array, limits: MotorLimits, end: float) -> MotorFeasibility:
    """The requirements of torques `moment` (T,), N·m or N, at rates (T,), rad/s or m/s, over `time` (T,), s.

    Root mean square and share of the time beyond limits are those from 0 to `end` (s), without pre- and post-actuation.
    """
    (peak, at), (speed, _), (power, _) = (largest(time, values) for values in (moment, rate, moment * rate))
    beyond = (np.abs(moment) > limits.moment) | (np.abs(rate) > limits.speed) | (np.abs(moment * rate) > limits.power)
    path, order = (time >= 0.0) & (time <= end), np.argsort(np.abs(moment))
    on_path, below = time[path], np.cumsum(shares(time)[order])
    usual = order[min(int(np.searchsorted(below, 0.99)), len(time) - 1)]
    return MotorFeasibility(
        moment=peak,
        moment_limit=limits.moment,
        speed=speed,
        speed_limit=limits.speed,
        power=power,
        power_limit=limits.power,
        saturation_time=float(first_time(time, beyond[:, None])[0]) if beyond.any() or peak <= limits.moment else at,
        rms_moment=root_mean_square(on_path, moment[path]),
        usual_moment=float(np.abs(moment[usual])),
        moment_time=at,
        share_beyond=float(shares(on_path) @ beyond[path]),
    )


def first_time(time: Array, beyond: Booleans) -> Array:
    """The first time (k,), s, of `time` (T,) at which each column of `beyond` (T, k) is true; NaN if never."""
    return np.where(beyond.any(axis=0), time[beyond.argmax(axis=0)], np.nan)


def path_jump(run: Run, at: float) -> str:
    """Return which derivative of a trajectory jumps near the time `at` (s), so that torques jump, too.

    That is "acceleration", in motors-only analyses also "jerk", else "". Before t = 0 and after the end paths rest.
    """
    end = run.analysis.last_time
    if end <= 0.0 or len(run.time) < 2:
        return ""
    h = INSTANT * end
    near = NEARBY * end * (round(at / end / NEARBY) + np.arange(-1.0, 2.0))
    for target in (target for path in run.model.scene.trajectory for _, target in path.targets):

        def acceleration(t: Array, target: TimeFunction = target) -> Array:
            return np.where(
                (t >= 0.0) & (t <= end), target.sample(np.clip(t, 0.0, end).ravel())[2].reshape(t.shape), 0.0
            )

        all_over = acceleration(np.linspace(0.0, end, 1001))
        before, after = (acceleration(near + side * h * np.array([[1.0], [2.0]])) for side in (-1, 1))
        limits = [2 * one[0] - one[1] for one in (before, after)]
        if np.any(np.abs(limits[1] - limits[0]) > JUMP * np.abs(all_over).max()):
            return "acceleration"
        jerks = (before[0] - before[1]) / h, (after[1] - after[0]) / h
        largest = np.abs(np.diff(all_over)).max() / (end / 1000)
        if run.analysis.follows_jerk and np.any(np.abs(jerks[1] - jerks[0]) > JUMP * largest):
            return "jerk"
    return ""
