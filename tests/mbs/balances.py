"""The energy of a run."""

from oracle_runs import energies
from scipy.integrate import simpson

OUTPUT_STEP = 2.5e-4  # fine enough that Simpson's rule errs by less than 1e-10 here


def energy_and_losses(outcome):
    """Total energy (T,) and what damping has taken by the end."""
    parts = energies(outcome)
    total = parts["kinetic"] + parts["strain"] + parts["gravitational"]
    return total, simpson(parts["dissipated_power"], x=outcome.time)
