"""Amplifiers of patches: limits, the current that a motion takes, and the voltages that arrive for wanted ones.

A patch is a capacitor that its link stretches. By reciprocity its charge is q = C V + Φ_Vᵀ p: Φ_V are the modal forces
of a volt, C is the capacitance on a link whose modes stand still (Lee and Moon, J. Appl. Mech. 57, 1990). Other strains
follow the voltages of all patches at once, and are part of C.

Of a voltage V over time the play operator of threshold r has z = max(V − r, min(V + r, z)), and a patch acts as under
the voltage Σ w z (Prandtl and Ishlinskii). The inverse has the same form (Kuhnen, Eur. J. Control 9, 2003, eq. 20).
"""

from collections.abc import Iterable
from dataclasses import fields, replace

import numpy as np

from ...common.arrays import Array
from ...common.structs import struct

MOST_PLAYS = 32
PASSES = 30  # at most, until voltages at limits of current agree
CHUNK = 1024  # voltages, all on one way up or down, whose play operators are found together


@struct
class Hysteresis:
    """Hysteresis of k patches, which act as under the effective voltage Σ w z of play operators z."""

    weights: Array  # (MOST_PLAYS, k) w, no unit; 0 of spare operators
    thresholds: Array  # (MOST_PLAYS, k) V, ascending from 0: z follows the voltage at this distance

    @property
    def acts(self) -> bool:
        """Whether the force of any patch is not proportional to its voltage."""
        return bool(self.weights[1:].any() or (self.weights[:1] != 1.0).any())

    @property
    def inverse(self) -> "Hysteresis":
        """Hysteresis from wanted effective voltages, V, to the voltages that patches need, from rest on."""
        W = np.cumsum(self.weights, axis=0)
        weights = np.diff(1.0 / W, axis=0, prepend=0.0)
        return Hysteresis(weights, W * self.thresholds - np.cumsum(self.weights * self.thresholds, axis=0))

    def plays(self, z: Array, V: Array) -> Array:
        """States (…, MOST_PLAYS, k) of play operators at voltages V (…, k) after z (MOST_PLAYS, k), all V.

        Voltages of each patch only rise, or only fall.
        """
        V = V[..., None, :]
        return np.clip(z, V - self.thresholds, V + self.thresholds)

    def acting(self, plays: Array) -> Array:
        """Effective voltages Σ w z (…, k), V, for z = `plays` (…, MOST_PLAYS, k), V."""
        return (self.weights * plays).sum(axis=-2)

    def output(self, V: Array) -> Array:
        """Effective voltages (T, k), V, of voltages V (T, k), V, linear between, from rest."""
        acting, z = np.empty_like(V), np.zeros_like(self.weights)
        turns = np.flatnonzero(np.diff(np.sign(np.diff(V, axis=0)), axis=0).any(axis=1)) + 2
        begins = np.union1d(turns, np.arange(0, len(V), CHUNK))
        for one, way in zip(np.split(acting, begins[1:]), np.split(V, begins[1:]), strict=True):
            plays = self.plays(z, way)
            one[:], z = self.acting(plays), plays[-1]
        return acting


class Played:
    """State of play operators step by step, from rest on; SI units."""

    def __init__(self, of: Hysteresis) -> None:
        self._of, self._z = of, np.zeros_like(of.weights)

    def at(self, V: Array, last: Array | None = None) -> Array:
        """Return effective voltages (k,) at V (k,), V, then move the state on to `last` (k,), V; None: to V."""
        output = self._of.acting(self._of.plays(self._z, V))
        self._z = self._of.plays(self._z, V if last is None else last)
        return output


@struct
class Amplifiers:
    """Amplifiers of k patches; without one, limits are infinite and voltages arrive at once. SI units."""

    range: Array  # (2, k) smallest and largest voltage, V
    slew: Array  # (k,) largest rate of the voltage, V/s
    current: Array  # (k,) largest current, A
    capacitance: Array  # (k, k) F, of patches on a link whose modes stand still
    bandwidth: Array  # (k,) of first order, Hz
    delay: Array  # (k,) s
    plays: Array  # (2, MOST_PLAYS, k) weights and thresholds of the patches' hysteresis
    # (k,) 1.0 where wanted voltages go through the inverse of the hysteresis first, else 0.0
    compensated: Array

    @property
    def lag(self) -> Array:
        """Time constants (k,), s, of the amplifiers."""
        return 1.0 / (2 * np.pi * self.bandwidth)

    @property
    def has_rates(self) -> bool:
        """Whether any rate or current is limited."""
        return bool(np.isfinite([self.slew, self.current]).any())

    @property
    def acts(self) -> bool:
        """Whether voltages may arrive late or with hysteresis."""
        return self.has_rates or self.hysteresis.acts or bool(self.lag.any() or self.delay.any())

    @property
    def hysteresis(self) -> Hysteresis:
        """Hysteresis of the patches."""
        return Hysteresis(*self.plays)

    @property
    def compensator(self) -> Hysteresis:
        """Inverse hysteresis between wanted voltages and amplifier; identity for patches without compensation."""
        inverse = self.hysteresis.inverse
        none = 1.0 - self.compensated
        weights = self.compensated * inverse.weights
        weights[0] += none
        return Hysteresis(weights, inverse.thresholds)

    def unlimited(self) -> "Amplifiers":
        """The same amplifiers without limits."""
        none = np.full_like(self.slew, np.inf)
        return replace(self, range=np.stack([-none, none]), slew=none, current=none)

    def advance(self, h: float, now: Array, wanted: tuple[Array, Array], strain: Array) -> tuple[Array, Array]:
        """Voltages (k,), V, after a step `h` (s) from those `now` (k,), and their means over it.

        `wanted`, two of (k,), V, is linear in the step, from the first to the second; `strain` (k,), A: current Φ_Vᵀ ṗ.
        """
        with np.errstate(divide="ignore"):
            x = h / self.lag
        first, last = (np.clip(one, *self.range) for one in wanted)
        decay, late = np.exp(-x), (last - first) / x
        share = -np.expm1(-x) / x
        after = last - late + (now - first + late) * decay
        mean = (first + last) / 2 - late + (now - first + late) * share
        unlimited = np.isinf(self.current)  # of which no capacitance is known
        own, kept = self.capacitance.diagonal(), after
        for _ in range(PASSES):
            felt = strain + (self.capacitance @ (kept - now) - own * (kept - now)) / h
            left = (np.where(unlimited, np.inf, (self.current - s) / own) for s in (felt, -felt))
            most, least = (h * np.minimum(self.slew, of) for of in left)
            before, kept = kept, np.clip(np.clip(after, now - least, now + most), *self.range)
            if np.array_equal(kept, before):
                break
        most = np.where(kept > now, most, least)
        ramp = kept - (kept - now) * np.abs(kept - now) / (2 * most)
        mean = np.where(np.abs(ramp - now) < np.abs(mean - now), ramp, mean)
        return kept, np.where(kept == after, mean, (now + kept) / 2)

    def output(self, times: Array, wanted: Array, strain: Array) -> Array:
        """Effective voltages (T, k), V, at `times` (T,), s, of `wanted` (T, k), linear between.

        `strain` (T, k), A: current by the strain of the patches, Φ_Vᵀ ṗ.
        """
        wanted = self.compensator.output(wanted)
        late = [np.interp(times - d, times, V) for d, V in zip(self.delay, wanted.T, strict=True)]
        asked, limited = np.stack(late, axis=1), np.zeros_like(wanted)
        limited[0] = np.clip(asked[0], *self.range)
        for k, h in enumerate(np.diff(times)):
            limited[k + 1] = self.advance(h, limited[k], (asked[k], asked[k + 1]), (strain[k] + strain[k + 1]) / 2)[0]
        return self.hysteresis.output(limited)


def joined(links: Iterable[Amplifiers]) -> Amplifiers:
    """The amplifiers of all patches of `links`, in this order."""
    none = {field.name: np.zeros(0) for field in fields(Amplifiers)}
    none |= {"range": np.zeros((2, 0)), "plays": np.zeros((2, MOST_PLAYS, 0)), "capacitance": np.zeros((0, 0))}
    parts = [none, *map(vars, links)]
    found = {key: [of[key] for of in parts] for key in none}
    blocks = found.pop("capacitance")
    ends = np.cumsum([len(block) for block in blocks])
    C = np.zeros((ends[-1], ends[-1]))
    for block, end in zip(blocks, ends.tolist(), strict=True):
        C[end - len(block) : end, end - len(block) : end] = block
    return Amplifiers(capacitance=C, **{key: np.concatenate(of, axis=-1) for key, of in found.items()})
