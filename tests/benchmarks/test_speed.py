"""How fast it is, on one core. Seconds are never asserted, only ratios of processor time to other work in the same run.

Run and compare on a quiet machine:

    .venv/bin/python -m pytest tests/benchmarks --benchmark-enable --benchmark-only
    … --benchmark-autosave, later --benchmark-compare

In test runs (--benchmark-disable, see pyproject.toml; some at night only) each runs once, and the ratios are checked:
bounds are two to three times what was measured, so that a slip in an algorithm is found and a busy machine is not.

* pcid: one second of the two-link model at tolerance 1e-6. Aim: under 0.5 s. An evaluation in the run, with what the
  integrator does to it, takes 2.3 times a bare one.
* fcid: 1000 outputs of the two-link model with straight links, and with sagging ones; extra_info has the solver's
  own time, without the check that the path is within reach (aim: 10 ms). With it, 77 and 160 evaluations an output.
* allocation: voltages of 20 patches for 20 modes at 1000 times, most of which meet limits. Aim: 50 ms; SciPy's general
  least squares with bounds takes 3000 times as long.
* link: stage 1 of a link in a process of its own, forms compiled before; as long as the import of its libraries.
"""

import subprocess
import sys
from pathlib import Path
from resource import RUSAGE_CHILDREN, RUSAGE_SELF, getrusage

import numpy as np
import pytest
from scipy.optimize import lsq_linear

from bench.hand_written import TIME, evaluation_seconds, general_state
from ffrobot.mbs import _core
from ffrobot.mbs.analysis.fcid import Fcid
from ffrobot.mbs.posture.path_start import path_start
from ffrobot.mbs.run import samples
from ffrobot.mbs.run.context import Context
from ffrobot.run.solve import prepare_scene
from ffrobot.run.watcher import Watcher

pytestmark = pytest.mark.alone

INVERSE = '\n[[analysis]]\nname = "inverse"\nkind = "pcid"\nend = 1.0\noutput_step = 0.001\ntolerance = 1e-6\n'
LIBRARIES = "import numpy, scipy.linalg, h5py, pydantic, rich, click"


def bare(model, count):
    """What makes so many evaluations of the model's equations."""
    state = general_state(model)
    return lambda: evaluation_seconds(state, TIME, count)


def context_of(scene):
    """What analyses of the scene start from."""
    model = prepare_scene(scene, Watcher()).model
    return Context(model=model, outcomes={}, progress=lambda t: True, path=path_start(model, 1.0))


def seconds(work):
    """Processor time of this process and of those that it started: other work on the machine does not count."""

    def used():
        return sum(getrusage(of).ru_utime for of in (RUSAGE_SELF, RUSAGE_CHILDREN))

    start = used()
    work()
    return used() - start


def ratio(work, beside):
    """Of their times, the least of five neighbours: a machine that slows down meanwhile slows both."""
    return min(seconds(work) / seconds(beside) for _ in range(5))


def process(*command):
    """What runs the command."""
    return lambda: subprocess.run(command, check=True, capture_output=True)


@pytest.fixture
def scene(case_copy):
    """The two-link case with the inverse analysis only; modal files and forms come from the cache of the tests."""
    path = case_copy("two_link")
    head = path.read_text(encoding="utf-8").split("[[analysis]]")[0]
    path.write_text(head + INVERSE, encoding="utf-8")
    return path


def test_pcid_of_one_second(benchmark, scene, monkeypatch):
    context = context_of(scene)
    run = context.model.scene.analysis[0].run
    outcome = benchmark(run, context)
    benchmark.extra_info |= {"steps": outcome.statistics.steps, "evaluations": outcome.statistics.evaluations}
    assert outcome.status == "completed"
    assert outcome.statistics.evaluations < 800_000
    # Few samples: new pages of memory take so long in some virtual machines that they hide what the core does
    monkeypatch.setattr(samples, "LOOKS", samples.LOOKS._replace(most=samples.LOOKS.intervals))
    assert ratio(lambda: run(context), bare(context.model, outcome.statistics.evaluations)) < 5


@pytest.mark.nightly
@pytest.mark.parametrize(("shape", "evaluations"), [("zero", 230), ("static", 480)])
def test_fcid_of_1000_outputs(benchmark, scene, shape, evaluations):
    context = context_of(scene)
    analysis = Fcid(name="fcid", kind="fcid", shape=shape, end=1.0, output_step=0.001)
    outcome = benchmark(analysis.run, context)
    benchmark.extra_info |= {"solver": outcome.statistics.wall_seconds}
    assert len(outcome.time) == 1001
    assert ratio(lambda: analysis.run(context), bare(context.model, evaluations * 1001)) < 1


def test_allocation_of_20_patches_at_1000_times(benchmark):
    rng, t = np.random.default_rng(9), np.linspace(0, 1, 1000)[:, None]
    Phi, one = rng.standard_normal((20, 20)), np.ones(20)
    F = 6 * np.sin(t * rng.uniform(5, 60, 20) + rng.uniform(0, 6, 20)) * rng.uniform(0.2, 2, 20)
    solver = _core.Allocation(Phi, np.eye(20), np.linalg.inv(Phi), -one, one, one)
    V = benchmark(solver.solve, F)
    assert np.mean(np.abs(V) == 1.0) > 0.2
    assert ratio(lambda: solver.solve(F), lambda: [lsq_linear(Phi, f, (-1.0, 1.0)) for f in F[::50]]) < 50 / 300


@pytest.mark.nightly
def test_stage_1_of_a_link(benchmark, scene, ffrobot):
    link = scene.with_name("link1.toml")
    benchmark.pedantic(lambda: ffrobot("link", link, "--force"), rounds=3, warmup_rounds=1)
    assert Path(link.with_suffix(".h5")).stat().st_size > 0
    libraries = f"{LIBRARIES}, dolfinx.fem, slepc4py.SLEPc"
    assert ratio(process(ffrobot.path, "link", link, "--force"), process(sys.executable, "-c", libraries)) < 2
