"""How the time of an evaluation grows with modes per link and with links in a chain, open and closed.

    .venv/bin/python -m pytest tests/benchmarks/test_growth.py --benchmark-enable -s

prints a table of minima of interleaved repetitions; linear growth means that the last column settles; `python -m bench
--part growth` draws it. In the ordinary test run timings are short. Growth is asserted as an exponent: 1.1 with links,
and 0.9 with modes from 50 on (what does not depend on their number still counts there), are measured.
"""

import numpy as np
import pytest
from tree_oracle import row_values

from bench.growth import LINKS, MODES, MODES_IN_CHAINS, chain, evaluation_timer
from bench.hand_written import start_at_rest, targets

pytestmark = pytest.mark.alone

ROUNDS = 15
NEARLY_LINEAR = 1.35


@pytest.mark.parametrize("closed", [False, True], ids=["open", "closed"])
def test_growth_with_links(benchmark, closed):
    times = table(benchmark, "links", LINKS, [chain(links, MODES_IN_CHAINS, closed=closed) for links in LINKS])
    assert exponent(LINKS, times, LINKS[0], LINKS[-1]) < NEARLY_LINEAR


def test_growth_with_modes(benchmark):
    times = table(benchmark, "modes", MODES, [chain(2, modes) for modes in MODES])
    assert exponent(MODES, times, 50, MODES[-1]) < NEARLY_LINEAR


def exponent(sizes, times, first, last):
    """k of time ~ sizeᵏ between two of the `sizes`."""
    at = dict(zip(sizes, times, strict=True))
    return np.log(at[last] / at[first]) / np.log(last / first)


def table(benchmark, what, sizes, models):
    cases = [start_at_rest(model) for model in models]
    for system, q, v in cases:
        core, _, rows = system.integrated
        a, multipliers = core.evaluate(q, v, targets(system, 0.0)[rows], None, None)
        assert np.all(np.isfinite(multipliers))
        C_v = row_values(system.model, q[None], np.zeros(1))[1][0]
        assert np.abs(C_v @ a).max() < 1e-6 * np.abs(C_v).max() * np.abs(a).max()  # at rest: Ċ_v v = 0, targets uniform
    timers = [evaluation_timer(case, 200_000 if benchmark.enabled else 20_000) for case in cases]
    times = 1e6 * np.min([[timer() for timer in timers] for _ in range(ROUNDS)], axis=0)
    benchmark.pedantic(lambda: None, rounds=1)
    benchmark.extra_info |= {f"{what} {size}": value for size, value in zip(sizes, times, strict=True)}
    print()
    for size, value in zip(sizes, times, strict=True):
        print(f"{size:4d} {what}: {value:9.2f} µs, {1e3 * value / size:7.1f} ns each")
    return times
