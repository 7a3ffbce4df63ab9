"""Copies of a filter's parameters, to go back to after a fault; compiled."""

from __future__ import annotations

from etb_hil.base.compiled import njit
from etb_hil.base.copying import copy_into, copy_matrix
from etb_hil.estimation.motion import ADAPTED, LEVEL, MOVING, STATES
from etb_hil.plant.physics import COULOMB, STICTION, Vector
from etb_hil.recording.samples import Float64

# The newer copy and the older one; in each T_c, T_st and what is adapted, then the covariance.
KEPT = (2, 1 + STATES, STATES)
_NEWER, _OLDER = 0, 1
_AT_COULOMB, _AT_STICTION = 0, 1


@njit(cache=True, error_model="numpy")
def keep(cov: Float64, p: Vector, n: int, kept: Float64) -> None:
    """Copy the parameters and their covariance; the newer copy becomes the older.

    `n`: number of states, `kept`: of the shape `KEPT`.
    """
    copy, older = kept[_NEWER], kept[_OLDER]
    copy_matrix(older, copy)
    copy[0, _AT_COULOMB], copy[0, _AT_STICTION] = p[COULOMB], p[STICTION]
    for k in range(MOVING, n):
        copy[0, k] = p[ADAPTED[k - MOVING]]
    for i in range(LEVEL, STATES):
        copy_into(copy[1 + i], LEVEL, cov[i, LEVEL:STATES])


@njit(cache=True, error_model="numpy")
def keep_in_both(cov: Float64, p: Vector, n: int, kept: Float64) -> None:
    """Make both copies those of the parameters as they are; see `keep`."""
    keep(cov, p, n, kept)
    keep(cov, p, n, kept)


@njit(cache=True, error_model="numpy")
def restore(cov: Float64, p: Vector, n: int, kept: Float64) -> None:
    """Restore the parameters of the older copy.

    The state stays as it is and counts as independent of them.
    """
    copy = kept[_OLDER]
    p[COULOMB], p[STICTION] = copy[0, _AT_COULOMB], copy[0, _AT_STICTION]
    for k in range(MOVING, n):
        p[ADAPTED[k - MOVING]] = copy[0, k]
    for i in range(LEVEL, STATES):
        for j in range(LEVEL):
            cov[i, j] = cov[j, i] = 0.0
        copy_into(cov[i], LEVEL, copy[1 + i, LEVEL:STATES])
