"""Declaration of a measurement; `MEASUREMENT = MeasurementKind(...)`."""

from etb_hil.diagnosis.findings import Findings as Findings
from etb_hil.diagnosis.measurement_kind import Estimate as Estimate
from etb_hil.diagnosis.measurement_kind import MeasurementKind as MeasurementKind
from etb_hil.diagnosis.segments import Segment as Segment

__all__ = ["Estimate", "Findings", "MeasurementKind", "Segment"]
