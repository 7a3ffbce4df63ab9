"""The armature current while the velocity is linear, in closed form."""

from __future__ import annotations

from etb_hil.base.compiled import njit
from etb_hil.plant.exactmath import exp_neg
from etb_hil.plant.physics import INDUCTANCE, RESISTANCE, Values

_SERIES_BELOW = 0.5

Answer = tuple[float, float, float, float]

NO_CURRENT = (0.0, 0.0, 0.0, 0.0)


@njit(cache=True, error_model="numpy")
def answer(h: float, p: Values) -> Answer:
    """Return exp(-x), phi_1, phi_2 and phi_3 of -x at x = R h / L.

    The phi_k are those of exponential integrators.

    With v = (u - K_e G_r omega) / L linear from v_0 to v_1 over h s, seed paper eq. (1) gives the current at the end,
    exp(-x) i + h ((phi_1 - phi_2) v_0 + phi_2 v_1), and its mean, phi_1 i + h ((phi_2 - phi_3) v_0 + phi_3 v_1).
    """
    x = p[RESISTANCE] * h / p[INDUCTANCE]
    if x > _SERIES_BELOW:
        decay = exp_neg(x)
        phi_1 = (1.0 - decay) / x
        phi_2 = (1.0 - phi_1) / x
        return decay, phi_1, phi_2, (0.5 - phi_2) / x
    s = x * x
    phi_3 = (
        (1.0 / 6.0 - x * (1.0 / 24.0))
        + s * (1.0 / 120.0 - x * (1.0 / 720.0))
        + s * s * ((1.0 / 5040.0 - x * (1.0 / 40320.0)) + s * (1.0 / 362880.0 - x * (1.0 / 3628800.0)))
    )
    phi_2 = 0.5 - x * phi_3
    phi_1 = 1.0 - x * phi_2
    return 1.0 - x * phi_1, phi_1, phi_2, phi_3
