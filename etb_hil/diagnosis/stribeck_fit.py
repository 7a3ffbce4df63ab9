"""T_st, T_c, omega_s and viscosity from a whole run.

LuGre's friction is fitted to Newton's law over windows.

Friction is odd in the direction of motion. What the bench's model has wrong (springs, inertia, motor constant, zero
of the current) is not, or goes with current and acceleration; it is fitted along, held by the model's tolerances, so
that it neither biases the friction nor is left out of its interval.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace

import numpy as np

from etb_hil.base.compiled import njit
from etb_hil.diagnosis.evidence import Evidence
from etb_hil.diagnosis.friction_model import (
    COULOMB,
    DROP,
    FRICTION_PARAMETERS,
    LAW_PARAMETERS,
    LOG_SPEED,
    VISCOUS,
    friction_along,
)
from etb_hil.diagnosis.half_width import TWO_SIDED_95
from etb_hil.diagnosis.prior import CONSTANT, INERTIA, LAG, OFFSET, PARAMETERS, USUAL, Prior
from etb_hil.diagnosis.segment_bootstrap import Spread, segment_bootstrap
from etb_hil.diagnosis.window_weights import kinds_of, mean_square, weights_by_kind, weights_of
from etb_hil.diagnosis.windows import window_means
from etb_hil.observer.normal_equations import accumulate, inverse, product, times
from etb_hil.plant.exactmath import log
from etb_hil.recording.samples import Float64, Int64

_STARTS = (1.0, 0.5, 2.0)  # times the model's omega_s: the cost has more than one valley
_LOW_START = 0.05  # rad/s, twice the slowest speed of a window: where the fall is looked for last
_ITERATIONS = 40
_CONVERGED = 1e-3  # in standard errors
LITTLE = 0.1  # of -2 log posterior density: a twentieth of what any likelihood ratio is judged by
_SAME_VALLEY = 0.5  # in standard errors: as near as that to an end that was found, a descent comes to the same one

STICTION = {COULOMB: 1.0, DROP: 1.0}  # T_st as a sum of parameters


@dataclass(frozen=True, slots=True)
class StribeckFit:
    """The fitted parameters (20), what they may be off by, and the residual.

    The parameters are in the order of `prior`. `friction` (m) is what the windows say of friction once the model's
    errors are taken off; `residual` (m) N·m is how far that lies above the curve of that time, `jacobian` (m, p) its
    derivatives by the fitted parameters, with the other sign. `counted` is the share of the log-likelihood that the
    scatter of the run bears out: 1 where residuals are noise.
    """

    parameters: Float64
    spread: Spread
    friction: Float64
    residual: Float64
    jacobian: Float64
    counted: float

    def reach(self, weights: Mapping[int, float]) -> float:
        """Return how far the truth may lie from a sum of parameters, in 95 %.

        `weights` are those of the sum, by the parameter's index.
        """
        return self.spread.reach(_gradient(weights))

    def error(self, weights: Mapping[int, float]) -> float:
        """Return the standard error of a weighted sum of parameters.

        The result is the error that the 95 % interval of the sum has.
        """
        return self.reach(weights) / TWO_SIDED_95

    def error_along(self, gradient: Float64) -> float:
        """Return the standard error of what has this `gradient` (20).

        The result is the error that its 95 % interval has.
        """
        return self.spread.reach(gradient) / TWO_SIDED_95

    def with_error(self, shift: Float64) -> StribeckFit:
        """Return the fit with one more standard error of its parameters (p)."""
        whole = _padded(shift)
        known = self.spread.known + whole[:, None] * whole[None, :]
        return replace(self, spread=replace(self.spread, known=known))

    @property
    def shows_fall(self) -> bool:
        """Whether friction falls from T_st to T_c, in 95 %."""
        return float(self.parameters[DROP]) > self.reach({DROP: 1.0})

    @property
    def stiction(self) -> tuple[float, float]:
        """T_st and its standard error, in N·m."""
        return float(self.parameters[COULOMB] + self.parameters[DROP]), self.error(STICTION)


def _gradient(weights: Mapping[int, float]) -> Float64:
    gradient = np.zeros(PARAMETERS)
    for index, weight in weights.items():
        gradient[index] = weight
    return gradient


def fit_stribeck(evidence: Evidence, prior: Prior) -> StribeckFit | None:
    """Fit by Levenberg's and Marquardt's method from several starts.

    Where friction does not fall with speed from there, it may do so below the speeds of the run: that is a start, too.
    None where none of them comes to an end.
    """
    one_kind = np.zeros(len(evidence), np.int64)

    def better(best: tuple[float, Linearised] | None, factor: float) -> tuple[float, Linearised] | None:
        known = None if best is None else best[1].parameters
        start = linearised(evidence, start_of(evidence, prior, factor), prior.count)
        found = _descend(evidence, prior, start, known, one_kind, LITTLE)
        return found if found is not None and (best is None or found[0] < best[0]) else best

    def concluded(best: Linearised) -> StribeckFit | None:
        return _refit(evidence, prior, best, kinds_of(evidence, best.parameters), 0.0)

    best = None
    for factor in _STARTS:
        best = better(best, factor)
    if best is None:
        return None
    fit = concluded(best[1])
    if fit is None or fit.shows_fall:
        return fit
    lower = better(best, _LOW_START / prior.stribeck_velocity)
    low = None if lower is None or lower is best else concluded(lower[1])
    return low if low is not None and low.shows_fall else fit


def refit(
    evidence: Evidence, prior: Prior, start: Float64, kinds_at: Float64 | None = None, little: float = 0.0
) -> StribeckFit | None:
    """Fit from parameters (20) that are near already, windows weighed by kind.

    None where the descent does not converge. Kinds are those at the parameters `kinds_at`, by default at the start. A
    descent that lowers -2 log posterior density by no more than `little` has converged.
    """
    # Bristles that are bent by an angle known in steps, after a rest above all, are off by more than any noise.
    kind = kinds_of(evidence, start if kinds_at is None else kinds_at)
    near = linearised(evidence, start, prior.count)
    return _refit(evidence, prior, near, kind, little)


def _refit(evidence: Evidence, prior: Prior, start: Linearised, kind: Int64, little: float) -> StribeckFit | None:
    weighed = _descend(evidence, prior, start, None, kind, little)
    return None if weighed is None else _conclude(evidence, prior, weighed[1], kind)


def start_of(evidence: Evidence, prior: Prior, factor: float) -> Float64:
    """Return where a descent begins.

    T_st and T_c are as slow and fast windows have them, and omega_s is the model's times `factor`. The model's
    viscosity comes off first: taken for T_c, it leads into a valley where friction rises with speed. From a small drop
    a descent finds a rise just as well.
    """
    q = prior.mean.copy()
    omega_s = factor * prior.stribeck_velocity
    q[LOG_SPEED] += log(factor)
    speed = np.abs(evidence.velocity)
    slow, fast = evidence.counts & (speed < 0.3 * omega_s), evidence.counts & (speed > 1.5 * omega_s)
    torque = evidence.motor - evidence.load
    along = np.where(evidence.velocity > 0.0, torque, -torque) - q[VISCOUS] * speed
    if np.any(slow):
        stiction = float(np.median(along[slow]))
        coulomb = float(np.median(along[fast])) if np.any(fast) else stiction
        q[COULOMB] = min(max(coulomb, 1e-2 * stiction), 0.9 * stiction)
        q[DROP] = stiction - q[COULOMB]
    return q


@dataclass(frozen=True, slots=True)
class Linearised:
    """Residuals (m) of the motor torque at parameters (20), and their Jacobian (m, p)."""

    parameters: Float64
    residual: Float64
    jacobian: Float64


def linearised(evidence: Evidence, q: Float64, count: int) -> Linearised:
    """Return residuals and Jacobian at parameters (20), by the first `count` of them.

    The residuals are the measured torque less that which the parameters call for. The measured current is what carries
    the noise, so it stands alone: were it multiplied by a fitted constant, a smaller constant would shrink the noise
    and pass for a better fit.
    """
    law = LAW_PARAMETERS if count > USUAL else 0
    ticks, windows = evidence.ticks, evidence.windows
    along = np.empty((1 + FRICTION_PARAMETERS + law, len(ticks)))
    friction_along(ticks.angle, ticks.samples, evidence.over_time, q, along)
    friction = window_means(along[0], windows.shape.mean, windows)
    shaft = friction + evidence.load + times(evidence.errors, q[INERTIA:OFFSET])
    scale = 1.0 / (1.0 + q[CONSTANT])
    jacobian = np.empty((len(windows), count))
    for index in range(FRICTION_PARAMETERS):
        jacobian[:, index] = window_means(along[1 + index], windows.shape.mean, windows) * scale
    jacobian[:, CONSTANT] = -shaft * scale * scale
    jacobian[:, INERTIA:OFFSET] = evidence.errors * scale
    jacobian[:, OFFSET] = evidence.per_ampere
    jacobian[:, LAG] = -evidence.motor_rate
    for index in range(count - USUAL):
        column = along[1 + FRICTION_PARAMETERS + index]
        jacobian[:, USUAL + index] = window_means(column, windows.shape.mean, windows) * scale
    sensed = evidence.per_ampere * q[OFFSET] - q[LAG] * evidence.motor_rate
    return Linearised(q, evidence.motor - (shaft * scale + sensed), jacobian)


@njit(cache=True, error_model="numpy")
def _cost(residual: Float64, weight: Float64, q: Float64, prior_mean: Float64, prior_precision: Float64) -> float:
    total = 0.0
    for k in range(len(residual)):
        total += weight[k] * residual[k] * residual[k]
    for a in range(len(q)):
        d = q[a] - prior_mean[a]
        total += prior_precision[a] * d * d
    return total


def _descend(
    evidence: Evidence, prior: Prior, start: Linearised, known: Float64 | None, kind: Int64, little: float
) -> tuple[float, Linearised] | None:
    """Return the residual mean square where a descent ends, and what is known there.

    None where it does not end, or where it comes to the end that is `known`.
    """
    here, damping, growth, count = start, 1e-3, 2.0, prior.count
    for _ in range(_ITERATIONS):
        q, residual, jacobian = here.parameters, here.residual, here.jacobian
        weight = weights_by_kind(residual, kind, evidence)
        matrix, gradient = prior.beside(jacobian, residual, weight, q)
        cost = _cost(residual, weight, q, prior.mean, prior.precision)
        for _ in range(8):
            damped = matrix.copy()
            scaled = damping * np.diag(matrix)
            damped[np.diag_indices(count)] += scaled
            covariance = inverse(damped)
            step = _padded(times(covariance, gradient))
            if not np.all(np.isfinite(step)):
                return None
            tried = linearised(evidence, q + step, count)
            gained = cost - _cost(tried.residual, weight, tried.parameters, prior.mean, prior.precision)
            if gained > 0.0:
                here = tried
                promised = float(np.sum(step[:count] * (gradient + scaled * step[:count])))
                as_promised = 2.0 * gained / promised - 1.0
                damping *= max(1.0 / 3.0, 1.0 - as_promised * as_promised * as_promised)
                growth = 2.0
                break
            damping, growth = growth * damping, 2.0 * growth
        else:
            break
        error = np.sqrt(np.diag(covariance))
        if known is not None and np.all(np.abs(here.parameters - known)[:count] < _SAME_VALLEY * error):
            return None
        if gained < little or np.all(np.abs(step[:count]) < _CONVERGED * error):
            break
    # Costs of different starts compare only at one precision; the profile over the noise level is its logarithm,
    # and the mean square orders the starts in the same way.
    return mean_square(here.residual[evidence.counts]), here


def _padded(values: Float64) -> Float64:
    """Return values of the fitted parameters, with zeros for those behind.

    The parameters are on the last axis.
    """
    out = np.zeros((*values.shape[:-1], PARAMETERS))
    out[..., : values.shape[-1]] = values
    return out


def _conclude(evidence: Evidence, prior: Prior, found: Linearised, kind: Int64) -> StribeckFit | None:
    q, residual, jacobian = found.parameters, found.residual, found.jacobian
    weight = weights_by_kind(residual, kind, evidence)
    matrix, _ = prior.beside(jacobian, residual, weight, q)
    held, bread = np.diag(prior.precision[: prior.count]), inverse(matrix)
    steps = segment_bootstrap(jacobian, residual, weight, evidence.cluster, held)
    known = np.zeros((PARAMETERS, PARAMETERS))
    known[: prior.count, : prior.count] = product(product(bread, held), bread)
    spread = Spread(_padded(steps), known)
    if not spread.is_finite:
        return None
    counted = min(float(bread[COULOMB, COULOMB]) / float(spread.covariance[COULOMB, COULOMB]), 1.0)
    return StribeckFit(q, spread, friction_of(evidence, q), residual, jacobian, counted)


def friction_of(evidence: Evidence, q: Float64) -> Float64:
    """Return the friction torque of windows (m) in N·m.

    The model's errors that parameters (20) have are taken off.
    """
    sensed = evidence.per_ampere * q[OFFSET] - q[LAG] * evidence.motor_rate
    measured = (evidence.motor - sensed) * (1.0 + q[CONSTANT])
    friction: Float64 = measured - evidence.load - times(evidence.errors, q[INERTIA:OFFSET])
    return friction


def widened_by(evidence: Evidence, prior: Prior, fit: StribeckFit, local: Float64) -> StribeckFit:
    """Return the fit with the uncertainty that friction off the curve adds.

    The uncertainty is taken to first order, for friction that is `local` (n) times the curve. What is not known of the
    friction of a place is wrong in every window that passes it: it is no noise, and no scatter shows it.
    """
    moved = linearised(replace(evidence, over_time=local), fit.parameters, USUAL).residual
    return fit.with_error(shifted(evidence, prior, fit, moved - fit.residual))


def shifted(evidence: Evidence, prior: Prior, fit: StribeckFit, moved: Float64) -> Float64:
    """Return by how much the parameters (p) move with the residuals.

    `moved` (m): by how many N·m those move. The result is of first order.
    """
    weight = weights_of(evidence, fit.parameters, fit.residual).of_all
    matrix, _ = prior.beside(fit.jacobian, fit.residual, weight, fit.parameters)
    found: Float64 = times(inverse(matrix), accumulate(fit.jacobian, moved, weight)[1])
    return found
