"""Sliding (Coulomb) torque T_c."""

from __future__ import annotations

from typing import TYPE_CHECKING

from etb_hil.diagnosis.measurement_kind import MeasurementKind
from etb_hil.diagnosis.result import Reason

if TYPE_CHECKING:
    from etb_hil.diagnosis.findings import Findings
    from etb_hil.diagnosis.measurement_kind import Estimate


def _coulomb(run: Findings) -> Estimate | None:
    """Return the fitted friction far above the Stribeck velocity.

    The viscous torque is taken off.
    """
    found, stiction = run.fitted.get("T_c"), run.fitted.get("T_st")
    if found is None or stiction is None:
        return None
    undecided = None
    if run.misfit is None and run.fastest < run.far:  # a faster plate tells nothing of friction by no law
        text = f"the plate never passed 2.15 omega_s ({run.fastest:.1f} of {run.far:.1f} rad/s)"
        undecided = Reason("T_c_not_reached", text)
    return run.with_gain(run.widening.of_coulomb(found, stiction), undecided=undecided)


MEASUREMENT = MeasurementKind(
    id="T_c",
    name="sliding friction",
    unit="N·m",
    compute=_coulomb,
    order=20,
    is_friction=True,
    source="seed paper, eq. (2) far above omega_s",
)
