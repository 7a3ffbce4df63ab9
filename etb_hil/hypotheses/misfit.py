"""What a fit lacks, by the channel that shows it."""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import NamedTuple

import numpy as np

from etb_hil.estimation.climbing import Fitted
from etb_hil.estimation.prior import over
from etb_hil.estimation.variances import OF_VOLTAGE, Q_VOLTAGE
from etb_hil.hypotheses.constants import CHANCE, EQUIVALENT_SHAPE, IMMATERIAL, MATERIAL, NEEDED, NOTHING, STEADY, WHITE
from etb_hil.plant.physics import COULOMB, INDUCTANCE, RESISTANCE, TORQUE_PER_AMPERE

ANY = (NEEDED,) * 6  # of each part: what any cause may leave


class Misfit(NamedTuple):
    """What a fit lacks in each channel; a part below 1 is immaterial.

    `torque` and `voltage`: the disturbance that it needs, and parameters beyond their tolerances that change it.
    `current`, `motor`, `plate`, `bridge`: noise of the readings of current, both angles and voltage beyond what is
    stated.
    """

    torque: float
    voltage: float
    current: float
    motor: float
    plate: float
    bridge: float

    @property
    def total(self) -> float:
        """The root of the sum of all squares."""
        return math.hypot(*self)

    @property
    def largest(self) -> int:
        """The place of the largest part."""
        return self.index(max(self))

    @property
    def is_nothing(self) -> bool:
        """Whether each part is immaterial."""
        return max(self) < NOTHING

    def is_little(self, without: Misfit) -> bool:
        """Tell whether this is what causes may leave of the misfit without them.

        All of it is at most what a shape that is not quite ours leaves. So is each material part.
        """
        if self.is_nothing:
            return True
        return self.total < EQUIVALENT_SHAPE * without.total and all(
            now < max(MATERIAL, EQUIVALENT_SHAPE * was) for now, was in zip(self, without, strict=True)
        )

    def lessens(self, before: Misfit, shares: Sequence[float] = ANY) -> bool:
        """Tell whether a cause with this misfit matters beside the misfit before it.

        It has to leave little of the largest part of that, or of another material one: as much as is needed of any
        cause, and of the same part's share, or nothing. By how much other parts grow is less than half of what it
        explains, or little of them: beside a large part a small one may be explained, and the large one may not be the
        same to a tenth.
        """
        pairs = [*zip(self, before, strict=True)]
        explained = sum(max(was * was - now * now, 0.0) for now, was in pairs)
        grown = sum(now * now - was * was for now, was in pairs if now > max(MATERIAL, STEADY * was))
        if grown > NEEDED**2 * explained:
            return False
        return any(
            was > (NOTHING if was == max(before) else MATERIAL)
            and now < NEEDED * was
            and now < max(NOTHING, share * was)
            for (now, was), share in zip(pairs, shares, strict=True)
        )

    def excludes(self, other: Misfit, least: Misfit) -> bool:
        """Tell whether another one has more than `least` in a part where this has little."""
        return any(its > at_least and own < NEEDED * its for own, its, at_least in zip(self, other, least, strict=True))

    def is_alternative_to(self, cause: Misfit, before: Misfit, least: Misfit) -> bool:
        """Tell whether this may explain what a cause explains of the misfit before.

        What lessens such a part by little only, and leaves more than `least`, explains another part, however likely.
        """
        lessened = cause.lessened_to(before, NEEDED)
        return any(
            (is_its or not any(lessened)) and now < was and (now < max(at_least, NEEDED * was) or own > NEEDED * now)
            for now, own, was, at_least, is_its in zip(self, cause, before, least, lessened, strict=True)
        )

    def share_of(self, before: Misfit, cause: Misfit) -> float:
        """Return the share of the misfit before that is left where a cause lessens it."""
        lessened = cause.lessened_to(before, NEEDED)
        parts = [part for part, is_its in enumerate(lessened) if is_its or not any(lessened)]
        return math.hypot(*(self[part] for part in parts)) / math.hypot(*(before[part] for part in parts))

    def lessened_to(self, before: Misfit, share: float) -> list[bool]:
        """Return which material parts of the misfit before are lessened to a share."""
        return [was > NOTHING and now < share * was for now, was in zip(self, before, strict=True)]


def misfit(fit: Fitted) -> Misfit:
    """Return the misfit of a fit.

    A disturbance voltage below the noise of its reading is not known; where no current is read, nothing distinguishes
    it from the torque of its current at rest.
    """
    p, noise = fit.parameters, fit.disturbance.noise
    immaterial = IMMATERIAL * p[COULOMB]
    torque, voltage = fit.filtered.needed
    voltage = math.sqrt(max(voltage**2 - fit.filtered.voltage_noise**2, 0.0)) * p[TORQUE_PER_AMPERE] / p[RESISTANCE]
    # What is known of the voltage's noise beside a disturbance voltage, which looks much the same.
    places = [len(fit.unknowns) + one for one in (OF_VOLTAGE, Q_VOLTAGE)]
    (noisy, mixed), (_, disturbed) = fit.normal.matrix[np.ix_(places, places)]
    known = noisy - (mixed * mixed / disturbed if disturbed > 0.0 else 0.0)
    beyond = over(p, fit.unknowns)
    electrical = np.array([one.place in (RESISTANCE, INDUCTANCE) for one in fit.unknowns], bool)
    torque = math.hypot(torque / immaterial, *beyond[~electrical])
    voltage = math.hypot(voltage / immaterial, *beyond[electrical])
    if not (fit.filtered.roots[:, 0] > 0.0).any():
        torque, voltage = math.hypot(torque, voltage), 0.0
    return Misfit(
        torque,
        voltage,
        _of_noise(*_read(fit, 0, noise.current)),
        _of_noise(*_read(fit, 1, 1.0)),
        _of_noise(*_read(fit, 2, noise.plate)),
        _of_noise(noise.voltage, 1.0 / math.sqrt(known)) if known > 0.0 else 0.0,
    )


def _of_noise(variance: float, deviation: float) -> float:
    """Return the part that a noise is, of a variance over what is stated.

    `deviation`: a share of it, by chance.
    """
    return math.sqrt(max(variance * (1.0 - CHANCE * deviation) - 1.0, 0.0) / WHITE)


def _read(fit: Fitted, m: int, scale: float) -> tuple[float, float]:
    """Return the mean square of a reading's innovations over what is stated.

    The second value is its standard deviation, as a share. `scale`: of its noise over what is stated. Instants without
    a reading do not count.
    """
    whitened = fit.filtered.whitened[fit.filtered.roots[:, m] > 0.0, m]
    return scale * float(np.mean(whitened**2)) if len(whitened) else 0.0, math.sqrt(2.0 / max(len(whitened), 1))
