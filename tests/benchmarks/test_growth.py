"""How the time of an evaluation grows with modes per link and with links in a chain, open and closed.

    .venv/bin/python -m pytest tests/benchmarks/test_growth.py --benchmark-enable -s

prints a table of minima; linear growth means that the last column settles; `ffrobot bench --part growth` draws it. In
the ordinary test run each size is evaluated once, and its multipliers are checked.
"""

import numpy as np
import pytest

from ffrobot.bench.growth import LINKS, MODES, MODES_IN_CHAINS, chain, evaluation_timer

ROUNDS = 15


def microseconds(state, enabled):
    timer = evaluation_timer(state, 200_000 if enabled else 1)
    return 1e6 * min(timer() for _ in range(ROUNDS if enabled else 1))


@pytest.mark.parametrize("closed", [False, True], ids=["open", "closed"])
def test_growth_with_links(benchmark, closed):
    table(benchmark, "links", LINKS, [chain(links, MODES_IN_CHAINS, closed) for links in LINKS])


def test_growth_with_modes(benchmark):
    table(benchmark, "modes", MODES, [chain(2, modes, False) for modes in MODES])


def table(benchmark, what, sizes, cases):
    for assembly, q, v in cases:
        a, lambda_ = assembly.system.evaluate(0.0, q, v)
        assert np.all(np.isfinite(lambda_))
        C_q = assembly.system.constraints(0.0, q, v)[2]
        assert np.abs(C_q @ a).max() < 1e-6 * np.abs(C_q).max() * np.abs(a).max()  # at rest: Ċ_q q̇ = 0, targets uniform
    times = [microseconds(case, benchmark.enabled) for case in cases]
    benchmark.pedantic(lambda: None, rounds=1)
    benchmark.extra_info |= {f"{what} {size}": value for size, value in zip(sizes, times, strict=True)}
    print()
    for size, value in zip(sizes, times, strict=True):
        print(f"{size:4d} {what}: {value:9.2f} µs, {1e3 * value / size:7.1f} ns each")
