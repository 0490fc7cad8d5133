"""Deliberate faults in the program, one at a time, and tests that must catch each.

    python tests/campaigns/faults.py [--build "COMMAND"] [NUMBER …]

writes each fault (a sign, a factor, an index, a term that is left out) into the source, runs its tests until the first
fails, and puts the source back. Exit code 1 where a fault stayed unseen. Run it in a work tree without other changes.
Faults of the core need the COMMAND that builds it and puts it in place; without it they are left out. The command runs
once more at the end, for the sound core.
"""

import argparse
import shlex
import subprocess
import sys
import time
from pathlib import Path
from typing import NamedTuple

ROOT = Path(__file__).parents[2]
PROJECTION, MASSES, LOADS = "mbs/model/projection.py", "mbs/model/masses.py", "mbs/quantities/link_loads.py"
PATCHES, RESULTS, CORE, MBS = "actuation/patches/", "ffrobot/results/", "mbs/core", "tests/mbs/"
RECURSION, INTEGRATE = f"{CORE}/recursion/", f"{CORE}/integrate/"
ABA, SPACE = RECURSION + "constrained_aba/", MBS + "recursion/test_space.py"
INVERSE, TREE, STATICS = RECURSION + "inverse/", MBS + "test_tree.py", MBS + "test_statics.py"
PROJECTED = "tests/mbs/test_projection.py tests/mbs/test_projected_trees.py"
POINTS = "tests/cases/test_actuation_points.py"
ARM = "tests/references/test_references.py::test_made_scenes[arm]"
PATCHED = "tests/references/test_references.py::test_made_scenes[arm_with_patches]"
REDUCED = "tests/references/test_references.py::test_made_scenes[arm_with_attachment_modes]"


class Fault(NamedTuple):
    """`old`, once in `file`, becomes `new`; `tests` are files or node ids."""

    file: str
    old: str
    new: str
    tests: str


FAULTS = [
    Fault(PROJECTION, "0.5 * (I[0, 1] - I[1, 0])", "0.5 * (I[0, 1] + I[1, 0])", PROJECTED),
    Fault(PROJECTION, "0.5 * about_center * np.eye(3)", "0.25 * about_center * np.eye(3)", PROJECTED),
    Fault(PROJECTION, "(1.0 - ALONG)[:, None] * at.rotation", "ALONG[:, None] * at.rotation", ARM),
    Fault(PROJECTION, "ALONG[:, None] * kept.S_bar,", "ALONG[:, None] * kept.S_bar[[1, 0, 2]],", PROJECTED),
    Fault(PROJECTION, "return moved + _keeping_shapes(I - moved)", "return moved", PROJECTED),
    Fault(MASSES, "np.eye(body.n_modes) + mass * Phi.T", "np.eye(body.n_modes) - mass * Phi.T", MBS + "test_body.py"),
    Fault(MASSES, "E = 0.5 * np.trace(inertia)", "E = np.trace(inertia)", MBS + "test_body.py"),
    Fault(LOADS, "force = -payload.mass * (of_point.a",
          "force = payload.mass * (of_point.a", "tests/test_mode_acceleration.py"),
    Fault(LOADS, "left -= wrench @", "left += wrench @", MBS + "test_link_loads.py"),
    Fault(RESULTS + "peaks.py", "run.space.along(of.reactions[joint.name].force)",
          "run.space.along(-of.reactions[joint.name].force)", ARM),
    Fault(RESULTS + "write.py", "function.sample(inside)[0]", "function.sample(inside)[1]", ARM),
    Fault(RESULTS + "peaks.py", "largest(time, column) for column in columns.T",
          "largest(time, column) for column in columns.T[::-1]", ARM),
    Fault(RESULTS + "write.py", '"modal": moved.modal, "modal_velocity": moved.modal_velocity',
          '"modal": moved.modal_velocity, "modal_velocity": moved.modal', REDUCED),
    Fault("actuation/points.py", "unmet = Q_a - np.einsum", "unmet = Q_a + np.einsum", POINTS),
    Fault("actuation/points.py", "[:, 6:] += held", "[:, 6:] -= held", POINTS),
    Fault(PATCHES + "records.py", "modulus * d31 / thickness",
          "modulus * d31", "tests/actuation/test_patches.py"),
    Fault(PATCHES + "records.py", "s * c**3 - (2 * S_22",
          "s * c**3 + (2 * S_22", "tests/actuation/test_patched_links_3d.py"),
    Fault(PATCHES + "link_patches.py", "V, within = forces @", "V, within = 2.0 * forces @", PATCHED),
    Fault("actuation/control/controllers.py", "np.eye(len(R)) + B.T @ X @ B, B.T",
          "np.eye(len(R)), B.T", "tests/actuation/test_kalman.py"),
    Fault("actuation/control/margins.py", 'record.rate == "measured"',
          'record.rate != "measured"', "tests/actuation/test_margins.py"),
    Fault(RECURSION + "newton_euler/newton_euler.cpp", "node.rotor_turns * A[Space::axis] + node",
          "node", MBS + "test_inverse.py"),
    Fault(RECURSION + "newton_euler/newton_euler.cpp", "component *= action.sign;",
          "component *= 1;", MBS + "test_path_forces_on_bodies.py"),
    Fault(RECURSION + "spatial/stiffening.cpp", "orthonormal_fields.L(1 + c, f)",
          "orthonormal_fields.L(1 + (c + 1) % 3, f)", SPACE),
    Fault(INTEGRATE + "dop853.h", "2 * way - (last + first)", "1 * way - (last + first)", MBS + "test_integrator.py"),
    Fault(INTEGRATE + "generalized_alpha.cpp", "rate_ - value_;", "rate_ + value_;", MBS + "test_integrator.py"),
    Fault(RECURSION + "planar/stiffening.cpp", "products[1] - center.y() * products[0];",
          "products[1] + center.y() * products[0];", MBS + "test_projected_trees.py"),
    Fault(ABA + "joint_elimination.h", "M[f] = (N * (N - c) * J) * U_by_D;",
          "M[f] = (N * N * J) * U_by_D;", MBS + "test_core_is_oracle.py"),
    Fault(RECURSION + "inverse/observe.cpp", "to.J(2, 2) += s.p_p;", "to.J(2, 2) += 0;", MBS + "test_projection.py"),
    Fault(RECURSION + "inverse/motors.cpp", "tau = motor.sign * Q_[motor.coordinate],",
          "tau = Q_[motor.coordinate],", MBS + "test_prescribed.py"),
    Fault(ABA + "joint_elimination.h", "A[2] -= sign * node.lead * A[5];", "A[2] -= node.lead * A[5];", SPACE),
    Fault(RECURSION + "numbers/multipliers.h", "      x[r] -= factor[k * m + r] * x[k];",
          "      x[r] -= factor[r * m + k] * x[k];", SPACE),
    Fault(RECURSION + "motion/motion_norm.cpp", "frequency > 0 ? 1 / frequency : 0",
          "frequency > 0 ? 1 / (frequency * frequency) : 0", MBS + "recursion/test_motion.py"),
    Fault(RECURSION + "motion/newton_system.cpp", "f -= factors.S.cwiseProduct(stiff);",
          "f += factors.S.cwiseProduct(stiff);", MBS + "recursion/test_newton.py"),
    Fault(RECURSION + "motion/postures.cpp", "unit[r] = -1;", "unit[r] = 1;", TREE),
    Fault(RECURSION + "motion/constraint_laws.cpp", "rate[r] -= targets[r].rate;",
          "rate[r] += targets[r].rate;", TREE),
    Fault(RECURSION + "motion/postures.cpp", "J.array().rowwise() *= scales", "J.array().rowwise() /= scales", TREE),
    Fault(INVERSE + "observe.cpp", "R.row(1).transpose(), R.row(2)", "R.row(2).transpose(), R.row(1)", TREE),
    Fault(INVERSE + "force_slopes.cpp", "found.lambda_q, K, -1);", "found.lambda_q, K, 1);", STATICS),
    Fault(INVERSE + "force_slopes.cpp", "of_i * of_j * stiffness", "of_i * stiffness", STATICS),
    Fault(RECURSION + "motion/mobility.cpp", "J(Eigen::all, ways) *= length;",
          "J(Eigen::all, ways) /= length;", TREE),
    Fault(RECURSION + "motion/mobility.cpp", "free * path.null_space(followed())",
          "free * path.null_space(followed() + 1)", TREE),
    Fault(RECURSION + "motion/independent_constraints.cpp", "S(i, i) < S(j, j)",
          "S(i, i) / own[i] < S(j, j) / own[j]", MBS + "recursion/test_motion.py"),
    Fault(CORE + "/linear/dense.cpp", "values[rank - 1] / values[0]", "values[rank - 1]", TREE),
]  # fmt: skip


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--build", type=shlex.split, default=[])
    parser.add_argument("numbers", nargs="*", type=int)
    asked = parser.parse_args()
    unseen = []
    for number in sorted(asked.numbers) or range(1, len(FAULTS) + 1):  # those of the core, built, after those of Python
        fault, began = FAULTS[number - 1], time.monotonic()
        if fault.file.startswith(CORE) and not asked.build:
            continue
        by = caught_by(fault, asked.build)
        print(f"{number:3d} {fault.file}: {fault.old!r} → {fault.new!r}: {by or 'NOT CAUGHT'} ", end="")
        print(f"({time.monotonic() - began:.0f} s)", flush=True)
        unseen += [] if by else [number]
    if asked.build:
        subprocess.run(asked.build, cwd=ROOT, check=True)
    sys.exit(bool(unseen))


def caught_by(fault: Fault, build: list[str]) -> str:
    """The first test that fails; empty where all pass."""
    path = ROOT / fault.file
    sound = path.read_text(encoding="utf-8")
    assert sound.count(fault.old) == 1, f"{fault.file}: expected {fault.old!r} once"
    command = [sys.executable, "-m", "pytest", "-n", "0", "-x", "-q", "--tb=no", "-p", "no:cacheprovider"]
    try:
        path.write_text(sound.replace(fault.old, fault.new), encoding="utf-8")
        if fault.file.startswith(CORE):
            subprocess.run(build, cwd=ROOT, check=True)
        done = subprocess.run([*command, *fault.tests.split()], cwd=ROOT, capture_output=True, text=True, check=False)
    finally:
        path.write_text(sound, encoding="utf-8")
    assert done.returncode in (0, 1), done.stdout + done.stderr
    failed = [line for line in done.stdout.splitlines() if line.startswith(("FAILED", "ERROR"))]
    return failed[0].split(" - ")[0].split(maxsplit=1)[1] if failed else ""


if __name__ == "__main__":
    main()
