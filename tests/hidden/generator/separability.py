"""Which effects a case can tell apart: cosines between sensitivities, the base parameters projected out."""

from dataclasses import asdict, dataclass

import numpy as np
from scipy.optimize import lsq_linear

from generator import layout as at
from generator.recipes import RECIPES
from generator.sensitivity import Sensitivities
from generator.unit import STATED_TOLERANCE, STOP_TOLERANCE
from generator.wrong_parameter import nominal_over_truth

ALIKE = 0.95
_ABSORBED = 0.2  # share of an effect left beside the base parameters below which a parameter is its name too
_BY_ORDER = {"friction_position_periodic", "cogging_torque", "torque_ripple"}
_PHASED = {*_BY_ORDER, "angle_sensor_eccentricity"}
_NOTHING_LEFT = 0.03  # share below which the rest is the error of the finite difference
_GOOD_SHARE = 0.15
_SEEN = 1e-3  # of a column over the noise: these sensors do not detect less
_DRAWS = 4
_WORTH = 0.2  # cosine above which more shapes of a competing effect are drawn: a few draws seldom hold the nearest
_MORE = 28
_NEAR = 0.8  # a cosine from which the nearest draw is moved on, towards the others of its form
_STEPS = 24
_ONE_ANGLE = {"encoder_only": ("angle_delay", "motor_angle_delay"), "plate_only": ("angle_delay", "plate_angle_delay")}
_LEAST_OWN = 1e-3  # ohm: with it the motor's own current lowers the supply by no more than millivolts


@dataclass(frozen=True)
class Separability:
    """Verdict of the generator on one hidden effect in its case.

    `cosines`: by rival, the largest over the rival's shapes (none where base parameters imitate the effect wholly);
    `kept`: share of the effect that no set of base parameters imitates; `visible`: residual over noise in the balance
    that shows it most, after base parameters were moved inside their stated tolerances; `parameters`: base parameters
    that imitate it; `look_alikes`: every id with a cosine of 0.95 and more.
    """

    effect: str
    cosines: dict
    kept: float
    visible: float
    parameters: tuple
    look_alikes: tuple

    @property
    def top_1_counts(self):
        """Whether the only right answer is the effect's own name."""
        return not self.look_alikes and not self.parameters


def separability(case, known=()):
    """One `Separability` for each hidden effect or wrong parameter of a case.

    `known`: base parameters and effects whose numbers were measured by hand: they imitate nothing.
    """
    columns = Sensitivities(case.rig, case.about["view"], case.sensors)
    parameters = columns.of_parameters()
    return tuple(_judge(case, entry, columns, parameters, known) for entry in case.truth["effects"])


def sealed(case, known=()):
    """The truth of a case together with what can be told apart in it, as plain values."""
    return {**case.truth, "separability": [asdict(verdict) for verdict in separability(case, known)]}


def _judge(case, entry, columns, parameters, known):
    name = entry["effect"]
    if name in at.ROW:
        own_row = case.effects[at.ROW[name]]
        own, base = columns.of_effect(name, own_row), _Base(parameters, without=known)
    else:
        wrong = name.removeprefix("parameter:")
        own_row = None
        own, base = parameters[wrong] * _beyond_tolerance(entry["strength"]), _Base(parameters, without=(wrong, *known))
    rest = base.projected_out(own)
    kept = float(np.linalg.norm(rest) / max(np.linalg.norm(own), 1e-12))
    rivals = [rival for rival in at.CATALOGUE if rival not in (name, *known) and kept > _NOTHING_LEFT]
    unit_rest = rest / max(np.linalg.norm(rest), 1e-12)
    cosines = {rival: _cosine(case, name, rival, own_row, columns, base, unit_rest) for rival in rivals}
    same = _ONE_ANGLE.get(case.about["view"], ())  # late angles, of which one is read
    cosines |= {rival: 1.0 for rival in same if name in same and rival != name}
    return Separability(
        name,
        cosines,
        kept,
        columns.visible(_within_tolerances(case.rig, own, base)),
        base.imitators(own) if kept < _ABSORBED and np.linalg.norm(own) > _SEEN else (),
        tuple(rival for rival, cosine in cosines.items() if cosine >= ALIKE),
    )


def _beyond_tolerance(ratio):
    """Relative error that is left of nominal over truth at the near edge of the tolerance."""
    return ratio / nominal_over_truth(1.0 if ratio > 1.0 else -1.0) - 1.0


def _cosine(case, name, rival, own_row, columns, base, unit_rest):
    """Largest cosine of the hidden effect with any shape of a rival (with any phase, where it has one)."""
    rng, recipe = np.random.default_rng(at.ROW[rival]), RECIPES[rival]

    def drawn(count):
        return [_shape(recipe, rival, rng, case.rig.unit) for _ in range(count)]

    def cosine(row):
        return _of_shape(rival, row, columns, base, unit_rest)

    first = drawn(_DRAWS if recipe.has_shape else 1)
    at_orders = [_at_order(first[0], order) for order in _orders(case.rig, name, rival, own_row)]
    also = [_low_battery(first[0])] if rival == "supply_sag" else []
    tried = [(cosine(row), row) for row in (*first, *at_orders, *also)]
    if recipe.has_shape and _largest(tried) > _WORTH:
        for row in drawn(_MORE):
            if _largest(tried) >= ALIKE:
                break
            tried.append((cosine(row), row))
    is_continuous = recipe.has_shape and rival not in _BY_ORDER  # a motor has whole numbers of slots
    return _moved_on(tried, cosine, rng) if is_continuous and _NEAR < _largest(tried) < ALIKE else _largest(tried)


def _largest(tried):
    return max(found for found, _ in tried)


def _moved_on(tried, cosine, rng):
    """Largest cosine on the way from the nearest row towards others of its form, as far as these reach."""
    largest, best = max(tried, key=lambda one: one[0])
    others = [row for _, row in tried if row[at.FORM] == best[at.FORM] and row is not best]
    for _ in range(_STEPS if others else 0):
        towards = others[rng.integers(len(others))]
        # Some of its numbers, a part of the way: what both draws allow mostly lies between them.
        row = best.copy()
        row[at.A :] += rng.uniform() * rng.integers(0, 2, best.size - at.A) * (towards - best)[at.A :]
        found = cosine(row)
        if found > largest:
            largest, best = found, row
        if largest >= ALIKE:
            break
    return largest


def _of_shape(rival, row, columns, base, unit_rest):
    """Cosine of the hidden effect with one shape of a rival, at its best phase."""
    phases = (0.0, 0.5 * np.pi) if rival in _PHASED else (None,)
    raw = []
    for phase in phases:
        shaped = row.copy()
        if phase is not None:
            shaped[at.A if rival == "angle_sensor_eccentricity" else at.B] = phase
        raw.append(columns.of_effect(rival, shaped))
    span = np.stack([base.projected_out(column) for column in raw], axis=1)
    lengths = np.linalg.norm(span, axis=0)
    if (lengths < np.maximum(1e-6, _NOTHING_LEFT * np.linalg.norm(raw, axis=1))).any():
        return 0.0  # the effect is in the span of the base parameters
    directions, _ = np.linalg.qr(span / lengths)
    return float(np.linalg.norm(directions.T @ unit_rest))


def _shape(recipe, rival, rng, unit):
    """Row of a rival: its shape drawn, its strength a usual one."""
    row = recipe.draw(rival, rng, unit)
    row[at.STRENGTH] *= recipe.start
    return row


def _low_battery(row):
    """A supply that is low by itself, under the current of others: the recipe hides it beside the motor's own alone."""
    row = row.copy()
    row[at.A] = row[at.STRENGTH] / _LEAST_OWN
    row[at.STRENGTH] = _LEAST_OWN
    return row


def _at_order(row, order):
    row = row.copy()
    row[at.A], row[at.FORM] = order, 0.0
    return row


def _orders(rig, name, rival, own_row):
    """Orders to try of a periodic rival: those of the motor turn, and the hidden effect's own where it is periodic."""
    if rival not in _BY_ORDER:
        return ()
    gear = rig.unit["gear_ratio"]
    in_turns = {1.0, 2.0}
    if name in _BY_ORDER:
        in_turns.add(own_row[at.A] / gear if name == "friction_position_periodic" else own_row[at.A])
    if name == "brush_contact_position":
        in_turns.add(own_row[at.A])
    scale = gear if rival == "friction_position_periodic" else 1.0
    return tuple(sorted(turns * scale for turns in in_turns))


def _within_tolerances(rig, own, base):
    """What is left of an effect once every base parameter has moved as far as its tolerance lets it."""
    low, high = [], []
    for name in base.names:
        if name in ("stop_low", "stop_high"):
            off = rig.nominal[name] - rig.unit[name]
            low.append(off - STOP_TOLERANCE)
            high.append(off + STOP_TOLERANCE)
        else:
            ratio = rig.nominal[name] / rig.unit[name]
            low.append(ratio * (1.0 - STATED_TOLERANCE) - 1.0)
            high.append(ratio * (1.0 + STATED_TOLERANCE) - 1.0)
    return base.least_within(own, np.array(low), np.array(high))


class _Base:
    """Sensitivities of the base parameters, ready to be taken out of others."""

    def __init__(self, parameters, without=()):
        self.names = [name for name in parameters if name not in without]
        self._basis, self._triangle = np.linalg.qr(np.stack([parameters[name] for name in self.names], axis=1))
        self._lengths = np.linalg.norm(self._triangle, axis=0)

    def projected_out(self, column):
        """What of a column no base parameter imitates."""
        return column - self._basis @ (self._basis.T @ column)

    def least_within(self, column, low, high):
        """What is left of a column with the base parameters moved inside their bounds at best."""
        high = np.maximum(high, low + 1e-9)
        bounds = (low * self._lengths, high * self._lengths)
        moved = lsq_linear(self._triangle / self._lengths, -self._basis.T @ column, bounds).x / self._lengths
        return column + self._basis @ (self._triangle @ moved)

    def imitators(self, column):
        """Parameters that do the imitating of a column: those with a good share of its length."""
        solved = np.linalg.lstsq(self._triangle, self._basis.T @ column, rcond=None)[0]
        shares = np.abs(solved) * self._lengths / np.linalg.norm(column)
        return tuple(name for name, share in zip(self.names, shares, strict=True) if share > _GOOD_SHARE)
