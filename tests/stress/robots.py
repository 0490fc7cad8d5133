"""Closed loops of rods or flexible links, runs of them, and what they keep."""

import numpy as np
import rods
from links import arm, ritz_link
from mechanisms import forward, pcid
from oracle_runs import run, total_energy
from rods import CRANK, ROD, rod

from ffrobot.mbs.quantities.supply import totals


def inverse(model, **keys):
    return run(model, pcid(**keys))


def free_run(model, **keys):
    return run(model, forward(**keys))


def pendulum(links=None, **keys):
    """The two-link arm without motors."""
    return arm(links, trajectory=[], initial={"angles": {"link1": -1.2, "link2": -1.0}}, **keys)


def reaching(x, y="0", angles=(-0.7, 0.7), **keys):
    """The two-link arm with its tip at x(t), y(t); stretched at a distance of 2."""
    initial = {"angles": dict(zip(("link1", "link2"), angles, strict=True))}
    return arm(trajectory=[{"name": "tip", "point": "link2.tip", "x": x, "y": y}], initial=initial, **keys)


def slider_crank(trajectory=None, *, flexible=True, angle=0.9, **initial):
    """Crank and rod in one line at x = 0.7 and 0.3; `trajectory` drives slider or crank."""
    flexible_rod = ritz_link("rod", "simply-supported", ROD, 1.5, damping_ratio=0.01)
    initial |= {"angles": {"crank": angle, "rod": -np.arcsin(CRANK * np.sin(angle) / ROD)}}
    return rods.slider_crank(trajectory, rod("rod", ROD, 1.5) if not flexible else flexible_rod, initial=initial)


def through_dead_centre(speed):
    """The slider's way for a crank that turns evenly, from 0.9 rad through 0."""
    phi = f"(0.9-{speed}*t)"
    return {"name": "slider", "point": "slider.pin", "x": f"{CRANK}*cos{phi}+sqrt({ROD**2}-{CRANK**2}*sin{phi}**2)"}


def energy_drift(outcome):
    """Largest change of total energy, relative to the swing of the kinetic energy."""
    total, kinetic = total_energy(outcome)
    return np.abs(total - total[0]).max() / np.ptp(kinetic)


def momentum_drift(outcome):
    """Largest change of linear or angular momentum, relative to the largest."""
    momentum = np.hstack(list(vars(totals(outcome.motion)[1]).values()))
    return np.abs(momentum - momentum[0]).max() / np.abs(momentum).max()
