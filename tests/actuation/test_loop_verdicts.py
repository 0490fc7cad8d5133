"""Verdicts of random closed loops against sampled models and runs written out here, of one inertia and of two."""

import numpy as np
import pytest
from rewritten_scenes import SYSTEMS, scaled
from scipy.linalg import expm, solve_discrete_are

import ffrobot
from ffrobot.actuation.control.metrics import LoopMotion, verdict_of

ARM, END, STANDARD = 0.3, 2.0, 10  # m from joint to tip; s; loops that are tried every time
UNSTABLE = {"unstable (linear)", "grows", "oscillates at its limits", "diverges"}


class Case:
    """A wheel I γ̈ = τ, or a rotor on a spring in front of it; sampled PID, LQR, observer; delay, limit, blow, noise."""

    def __init__(self, seed):
        self.rng = rng = np.random.default_rng(seed)
        self.T = float(rng.choice([0.002, 0.005, 0.01]))
        self.delay = float(rng.choice([0.0, 0.3, 1.0, 1.7])) * self.T
        self.inertia, self.spring = float(rng.uniform(0.2, 1.0)), None
        self.kind = ("pid", "lqr", "observer", "pid")[seed % 4]
        if rng.random() < 0.5:
            self.spring = float(rng.uniform(0.05, 0.5)), float(10 ** rng.uniform(2, 3.5)), float(rng.uniform(0.0, 2.0))
        self.limit = float(rng.uniform(0.3, 3.0)) if rng.random() < 0.5 else np.inf
        self.noise = 1e-5 if rng.random() < 0.2 else 0.0
        self.blow = float(rng.uniform(1.0, 5.0))
        self.A, self.B, self.E = self.plant()
        self.controller = {"pid": self.pid, "lqr": self.lqr, "observer": self.observer}[self.kind]()

    def plant(self):
        """x = (angles, rates): of the wheel alone, or of motor and wheel; what the torque and the blow do."""
        if self.spring is None:
            of_torque = np.array([[0], [1 / self.inertia]])
            return np.array([[0, 1], [0, 0.0]]), of_torque, ARM * of_torque
        rotor, k, c = self.spring
        M, one = np.diag([rotor, self.inertia]), np.array([[1.0, -1.0], [-1.0, 1.0]])
        A = np.block([[np.zeros((2, 2)), np.eye(2)], [-np.linalg.solve(M, k * one), -np.linalg.solve(M, c * one)]])
        return A, np.array([[0], [0], [1 / rotor], [0.0]]), np.array([[0], [0], [0], [ARM / self.inertia]])

    def held(self, t):
        """e^{A t} and what a unit of torque and of the blow do in t."""
        n = len(self.A)
        both = expm(np.block([[self.A, self.B, self.E], [np.zeros((2, n + 2))]]) * t)
        return both[:n, :n], both[:n, n : n + 1], both[:n, n + 1 :]

    @property
    def reads(self):
        """Rows of angle and rate of the motor's coordinate, where the torque acts; of LQR all states."""
        n = len(self.A)
        return np.eye(n) if self.kind == "lqr" else np.eye(n)[[0, n // 2]]

    def pid(self):
        """Critical damping of all inertia, by random factors; its states are the last angle and the sum, where used."""
        J, rng = self.inertia + (self.spring[0] if self.spring else 0.0), self.rng
        omega = float(rng.uniform(0.03, 1.2)) / self.T / (1 + self.delay / self.T)
        P, D = J * omega**2 * float(rng.uniform(0.3, 1.0)), 2 * J * omega * float(rng.uniform(0.2, 1.2))
        integral, differences = (P * omega * 0.1 if rng.random() < 0.4 else 0.0), bool(rng.random() < 0.5)
        side = "motor" if self.spring else "joint"
        of = {"proportional": {"O": P}, "derivative": {"O": D}, "integral": {"O": integral}}
        self.record = {"kind": "joint-pid", "side": side, "rate": "difference" if differences else "measured"} | of
        Dd, Dm = (D / self.T, 0.0) if differences else (0.0, D)
        used = np.array([differences, integral > 0.0])
        into = np.array([[1.0, 0.0], [self.T, 0.0]])[used]
        D_all = np.array([[-P - Dd - integral * self.T, -Dm]])
        return np.diag([0.0, 1.0])[np.ix_(used, used)], into, np.array([[Dd, -integral]])[:, used], D_all

    def waiting(self):
        """The plant with commands on their way, oldest first, as the controllers here know it."""
        late = int(np.ceil(self.delay / self.T - 1e-9))
        A, after, _ = self.held(self.T)
        new = after if self.delay % self.T < 1e-12 else self.held(self.T - self.delay % self.T)[1]
        n = len(A)
        F, G = np.zeros((n + late, n + late)), np.zeros((n + late, 1))
        F[:n, :n] = A
        if late:
            F[:n, n], G[-1] = (after if self.delay % self.T < 1e-12 else after - new)[:, 0], 1.0
            F[n:-1, n + 1 :] = np.eye(late - 1)
            if late > 1 and self.delay % self.T > 1e-12:
                F[:n, n + 1] = new[:, 0]
            elif self.delay % self.T > 1e-12:
                G[:n] = new
        else:
            G[:n] = new
        return F, G

    def gains(self, angle, rate, torque):
        """Of least Σ (γ/angle)² + (γ̇/rate)² + (u/torque)², commands on their way for next to nothing."""
        F, G = self.waiting()
        n = len(self.A) // 2
        Q = np.diag(
            np.r_[np.full(n, angle**-2.0), np.full(n, rate**-2.0), np.full(len(F) - 2 * n, 1e-9 * torque**-2.0)]
        )
        X = solve_discrete_are(F, G, Q, np.eye(1) * torque**-2.0)
        return np.linalg.solve(torque**-2.0 + G.T @ X @ G, G.T @ X @ F)

    def lqr(self):
        """Its states are the commands on their way; for another sample time than that of the loop it may fail."""
        angle, rate, torque = 10 ** self.rng.uniform([-3, -2, -0.5], [-1, 0, 1.5])
        self.record = {"kind": "lqr", "angle": angle, "rate": rate, "moment": torque, "inputs": "motors"}
        K = self.gains(angle, rate, torque)
        n = len(self.A)
        late = K.shape[1] - n
        shift, last = np.eye(late, k=1), np.zeros((late, 1))
        last[-1:] = 1.0
        return shift - last @ K[:, n:], -last @ K[:, :n], -K[:, n:], -K[:, :n]

    def observer(self):
        """Of the angle alone, by random weights; half of them scaled by more than their margin."""
        F, G = self.waiting()
        H = np.zeros((1, len(F)))
        H[0, 0] = 1.0
        noise = 10 ** self.rng.uniform(-6, -2)
        drives = np.zeros((len(F), 1))
        drives[: len(self.A)] = self.held(self.T)[1] + 0.1 * self.held(self.T)[2]
        S = solve_discrete_are(F.T, H.T, drives @ drives.T + 1e-12 * np.eye(len(F)), np.eye(1) * noise**2)
        L = F @ S @ H.T / (H @ S @ H.T + noise**2)
        K = self.gains(*10 ** self.rng.uniform([-2, -1, 0], [-1, 0, 1])) * float(self.rng.choice([1.0, 1.0, 2.5, 6.0]))
        A, into = F - L @ H - G @ K, np.hstack([L, 0 * L])

        def controller(setup):
            state, (angle,) = {"z": np.zeros(len(F))}, setup.columns("motor/O" if self.spring else "joint/O")

            def at_sample(k, y):
                e = y[angle] - setup.reference[k, angle]
                u, state["z"] = -K @ state["z"], A @ state["z"] + L[:, 0] * e
                return u

            return at_sample

        self.record = {"kind": "python", "python": controller}
        return A, into, -K, np.zeros((1, 2))

    def radius(self):
        """Of the sampled loop: plant and commands on their way, and the controller."""
        F, G = self.waiting()
        A, B, C, D = self.controller
        y = np.hstack([self.reads, np.zeros((len(self.reads), len(F) - len(self.A)))])
        return np.abs(np.linalg.eigvals(np.block([[F + G @ D @ y, G @ C], [B @ y, A]]))).max()

    def run(self):
        """Angles of the wheel at samples, and commands, cut at the limit."""
        A, B, C, D = self.controller
        late, part = divmod(self.delay + 1e-12, self.T)
        x, z, angles, commands = np.zeros(len(self.A)), np.zeros(len(A)), [], [0.0] * (int(late) + 1)
        before, after = self.held(part), self.held(self.T - part)
        for k in range(round(END / self.T)):
            y = self.reads @ x
            u = float(np.clip((C @ z + D @ y)[0], -self.limit, self.limit))
            z = A @ z + B @ y
            commands.append(u)
            angles.append(x[len(x) // 2 - 1])
            force = self.blow if k * self.T < 0.1 - 1e-9 else 0.0
            for (phi, of_u, of_force), acting in zip((before, after), commands[-int(late) - 2 :], strict=False):
                x = phi @ x + of_u[:, 0] * acting + of_force[:, 0] * force
        return np.array(angles), np.array(commands[int(late) + 1 :])

    def expected(self):
        """Verdicts that are right."""
        if self.radius() > 1.0 + 1e-6:
            return UNSTABLE
        angles, commands = self.run()
        last = commands[7 * len(commands) // 8 :]
        if (last >= self.limit).any() and (last <= -self.limit).any():
            return {"oscillates at its limits"}
        off = np.abs(angles - angles[-1])
        moves = off[9 * len(off) // 10 :].max() / off.max()
        found = {"stable"} if moves < 0.06 or self.noise else set()
        return found | ({"not settled"} if moves > 0.04 else set())

    def tables(self):
        """Of its scene."""
        points = {"root": [0.0, 0.0], "rim": [ARM, 0.0]}
        body = {"mass": 1.0, "inertia": self.inertia, "center": [0.0, 0.0], "points": points}
        joint = {"name": "O", "type": "revolute", "between": ["ground", "w.root"]}
        if self.spring:
            rotor, k, c = self.spring
            joint |= {"gear_ratio": 10.0, "rotor_inertia": rotor / 100, "stiffness": k, "damping": c}
        if np.isfinite(self.limit):
            joint["moment_limit"] = self.limit
        subject = "motor" if self.spring else "joint"
        loop = {
            "name": "loop", "kind": "closed-loop", "actuation": "still", "sample_time": self.T, "delay": self.delay,
            "controller": [self.record], "tip": "w.rim",
            "sensor": [{subject: "O", "noise": self.noise}, {subject: "O", "measure": "rate"}],
            "disturbance": [{"point": "w.rim", "y": f"where(t < 0.1, {self.blow}, 0)"}],
        }  # fmt: skip
        return {
            "name": "case", "gravity": [0.0, 0.0], "body": [{"name": "w", "rigid": body}], "joint": [joint],
            "trajectory": [{"name": "stand", subject: "O", "value": "0"}],
            "analysis": [{"name": "still", "kind": "pcid", "end": END, "output_step": 0.01}, loop],
        }  # fmt: skip


def about_loop(tables):
    return ffrobot.solve(ffrobot.make_scene(**tables)).attributes("loop/control")


@pytest.mark.parametrize("system", ["µm, mg, ms", "km, kt, h", "a robot of a size of 1e-5"])
def test_verdicts_do_not_depend_on_units(system):
    for seed in (0, 3, 7, 8):
        tables = Case(seed).tables()
        about, other = about_loop(tables), about_loop(scaled(tables, SYSTEMS[system]))
        assert other["verdict"] == about["verdict"]
        assert other["spectral_radius"] == pytest.approx(about["spectral_radius"], abs=1e-9)


@pytest.mark.parametrize(
    "seed", [*range(STANDARD), *(pytest.param(k, marks=pytest.mark.nightly) for k in range(STANDARD, 40))]
)
def test_verdicts_are_those_of_the_sampled_model_and_the_run(seed):
    case = Case(seed)
    about = about_loop(case.tables())
    assert about["spectral_radius"] == pytest.approx(case.radius(), abs=1e-5)
    assert about["verdict"] in case.expected()


@pytest.mark.parametrize(("end", "verdict"), [(0.43, "grows"), (2.0, "diverges")])
def test_loops_that_grow_beyond_all_numbers_are_judged_without_a_word_of_numpy(recwarn, end, verdict):
    """A mass on a slider, whose error grows 2.449-fold a sample: beyond 1e154 squares overflow, and steps end."""
    body = {"name": "a", "rigid": {"mass": 1.0, "inertia": 0.01, "center": [0.2, 0.0], "points": {"root": [0.0, 0.0]}}}
    gains = {"kind": "joint-pid", "proportional": {"O": 1e7}, "derivative": {"O": 1.0}}
    loop = {"name": "l", "kind": "closed-loop", "actuation": "i", "sample_time": 0.001, "controller": [gains]}
    results = ffrobot.solve(
        ffrobot.make_scene(
            name="slider", gravity=[0.0, 0.0], body=[body],
            joint=[{"name": "O", "type": "prismatic", "axis": [1.0, 0.0], "between": ["ground", "a.root"]}],
            trajectory=[{"name": "t", "joint": "O", "via": [0.0, 0.5], "duration": 0.3}],
            analysis=[of | {"end": end, "output_step": 0.01} for of in ({"name": "i", "kind": "pcid"}, loop)],
        )
    )  # fmt: skip
    assert not [str(one.message) for one in recwarn if issubclass(one.category, RuntimeWarning)]
    assert results.attributes("l/control")["verdict"] == verdict


@pytest.mark.parametrize(("grows", "verdict"), [(False, "stable"), (True, "grows")])
def test_tips_that_ring_from_the_end_of_their_path_on_are_no_loops_that_grow(grows, verdict):
    """The final position is the place of a tip from then on, which rings in the inverse analysis as well."""
    t = np.linspace(0.0, 2.0, 4001)
    size = 1e-6 * np.exp(3.0 * t) if grows else np.where(t < 1.0, 1e-6, 1e-3 + 1e-4 * t)
    run = LoopMotion(
        time=t, error=(size * np.sin(60.0 * t))[:, None], place_at=lambda t: np.minimum(t, 1.0)[:, None],
        rates=np.zeros((4001, 1)), held=np.zeros((4001, 1)), completed=True, is_disturbed=False, quiet=1.0, length=1.0,
    )  # fmt: skip
    samples = t[::2], np.zeros(2001)
    assert verdict_of(run, np.zeros((2001, 1)), samples, 10.0, None, is_seen=False) == verdict
