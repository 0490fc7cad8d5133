"""How the campaigns of tolerances judge a run: what errors of histories count relative to, and its record.

Histories are arrays (T,) or (T, columns) by kind and by name.
"""

import numpy as np

NEGLIGIBLE = 1e-3  # of the largest peak of a kind
NOTHING = 1e-9  # modal forces over forces
SLOW = 0.01  # rad in the time of a run: what the rate of a joint counts relative to at least


def largest(values):
    return float(np.abs(values).max())


def peaks(exact):
    """What the error of each history counts relative to: its peak, or a share of the largest of its kind."""
    found = {}
    for kind, members in exact.items():
        of = {name: largest(values) for name, values in members.items()}
        found[kind] = {name: max(peak, NEGLIGIBLE * max(of.values())) for name, peak in of.items()}
    return found


def with_body_velocity(own, mass, fastest):
    """What modal velocities count relative to, whose own peak that is, on a body that moves by `fastest` (m/s)."""
    return max(own, float(np.sqrt(mass)) * fastest)


def with_slow_rates(rates, duration):
    return {name: max(peak, SLOW / duration) for name, peak in rates.items()}


def nothing_of_rounding(scale, kinds, forces):
    """Sets to zero what only rounding leaves of modal forces where motors alone do it."""
    if max(scale.get(kinds[0], {}).values(), default=0.0) < NOTHING * forces:
        for kind in kinds:
            scale[kind] = dict.fromkeys(scale.get(kind, {}), 0.0)


def largest_errors(found, exact, scale):
    """By kind, the largest error at any output, in parts of `scale`, and which history it is of."""
    errors = {}
    for kind, members in exact.items():
        of = {
            name: largest(found[kind][name] - values) / scale[kind][name]
            for name, values in members.items()
            if scale[kind][name] > 0
        }
        if of:
            errors[kind] = max((error, name) for name, error in of.items())
    return errors


def record_of_run(asked, ran, tolerance, status, evaluations, errors):
    """One run of a robot; errors(), of runs that are completed, counts in tolerances here."""
    run = {"integrator": asked, "ran": ran, "tolerance": tolerance, "status": status, "evaluations": int(evaluations)}
    if status == "completed":
        run["errors"] = {kind: (float(f"{error / tolerance:.3g}"), name) for kind, (error, name) in errors().items()}
    return run
