"""The general core against the two-link case written by hand (tools/bench/hand_written.cpp), in one run on one core.

    .venv/bin/python -m pytest tests/benchmarks/test_hand_written.py --benchmark-enable -s

prints, as minima of interleaved repetitions: time per evaluation of both and their ratio; time of PCID from the
undeformed start against the hand-written one in equal steps of DOP853, both with λ to 1e-4 of its peak. 1.5 and 2.1 are
measured (docs/benchmarks.md); an alarm is half as much again. Repetitions go on until both minima are those of a quiet
machine, at most `MOST` rounds: only what is slower rings, not what else the machine does.
"""

from pathlib import Path

import numpy as np
import pytest

from bench.hand_written import STEPS, TIME, HandWritten, evaluation_seconds, general_state, targets
from ffrobot.common.errors import InputError
from ffrobot.mbs.analysis.pcid import Pcid
from ffrobot.mbs.posture.path_start import path_start
from ffrobot.mbs.run.context import Context
from ffrobot.run.solve import prepare_scene
from ffrobot.run.watcher import Watcher

ROOT = Path(__file__).parents[2]
ALARM = {"evaluation": 2.25, "pcid": 3.2}
MOST = 40


@pytest.fixture(scope="module")
def two_link(case_copy_of_module):
    return prepare_scene(case_copy_of_module("two_link"), Watcher()).model


@pytest.fixture(scope="module")
def program(tmp_path_factory, two_link):
    """Runs the compiled program: lists of the numbers in each line it prints."""
    return HandWritten(ROOT, two_link, tmp_path_factory.mktemp("program"))


def test_both_compute_the_same(two_link, program):
    system, q, v = general_state(two_link)
    core, _, rows = system.integrated
    a, multipliers = core.evaluate(q, v, targets(system, TIME)[rows], None, None)
    _, (force_x, force_y, alpha, _) = program(1, 0)
    # the program takes displacements of 1e-12 m at supports for zero; forces amplify that
    np.testing.assert_allclose(-multipliers, [force_x, force_y], rtol=1e-8)
    first = two_link.tree.nodes[0]  # its frame turns by the joint's angle less what modes turn the section by
    of_frame = a[first.v.start] - first.body.points["root"].rotation[2] @ a[first.p_v]
    assert alpha == pytest.approx(of_frame, abs=1e-8 * np.abs(a).max())


def test_without_the_source_tree_it_says_what_is_missing(two_link, tmp_path):
    with pytest.raises(InputError, match=r"expected ffrobot's source tree, found no tools/bench/hand_written"):
        HandWritten(tmp_path, two_link, tmp_path)


@pytest.mark.alone
@pytest.mark.nightly
def test_right_hand_side_ratio(benchmark, two_link, program):
    state = general_state(two_link)
    count = 20_000 if benchmark.enabled else 4_000

    def both():
        return evaluation_seconds(state, TIME, count), program.evaluation_seconds(count)

    times = minima(both, "evaluation", 15 if benchmark.enabled else 5)
    benchmark.pedantic(both, rounds=1)
    report(benchmark, "evaluation", *times)


@pytest.mark.alone
@pytest.mark.nightly
def test_pcid_ratio(benchmark, two_link, program):
    analysis = Pcid(name="inverse", kind="pcid", end=1.0, output_step=0.1, tolerance=1e-4)
    context = Context(model=two_link, outcomes={}, progress=lambda t: True, path=path_start(two_link, 1.0))
    outcomes, hand_written = [], []

    def both():
        outcomes.append(analysis.run(context))
        hand_written.append(program(1, STEPS)[2:])
        return outcomes[-1].statistics.wall_seconds, hand_written[-1][0][0]

    times = minima(both, "pcid", 5 if benchmark.enabled else 3)
    force = -outcomes[0].multipliers[-1]
    peak = 67.0  # N, of the tip force (cases/two_link)
    np.testing.assert_allclose(force, hand_written[0][1][:2], atol=2e-4 * peak)
    benchmark.pedantic(lambda: None, rounds=1)
    report(benchmark, "pcid", *times)


def minima(both, what, rounds):
    """Least times (s) of the general core and of the program; of more than `rounds` as long as the alarm rings."""
    times = [both() for _ in range(rounds)]
    while len(times) < MOST:
        general, hand_written = np.min(times, axis=0)
        if general / hand_written < ALARM[what]:
            break
        times.append(both())
    return np.min(times, axis=0)


def report(benchmark, what, general, hand_written):
    ratio = general / hand_written
    benchmark.extra_info |= {"general": general, "hand_written": hand_written, "ratio": ratio}
    print(f"\n{what}: general {general:.4g} s, hand-written {hand_written:.4g} s, ratio {ratio:.2f}")
    assert ratio < ALARM[what]
