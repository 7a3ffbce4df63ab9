"""The result of `explain`, typed.

The result says what the model lacks of a measurement, why, and how well that is known.

`explanation.json` holds these fields. Values are SI; intervals are 95 %. What is not known is None.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field

from etb_hil.results.explained.causes import Candidate, Cause, Isolation, MeasuredParameter, Transfer
from etb_hil.results.explained.errors import Errors, Gain, Starts
from etb_hil.results.explained.models import CalibratedParameter, Consequence, ModelFile, ModelledFriction, Nuisance
from etb_hil.results.explained.next_test import NextTest
from etb_hil.results.explained.residual import (
    BalanceResidual,
    Confounded,
    DataQuality,
    DetectionLimit,
    FreeRun,
    Unexplained,
)

SCHEMA = "etb_hil/explanation/3"


@dataclass(frozen=True, slots=True)
class ExplanationResult:
    """Everything that `explain` found.

    `data_quality` holds sentences where data could not be judged. `isolations` are the ids that left the ambiguity
    groups, `rejected_recordings` the reasons why others than the first could not be used.

    `interrupted` names the work that an interrupt ended, `stages` what was done by then. `runs`, `starts` and
    `judged_by` are of data too slow to name causes by.
    """

    verdict: str
    causes: tuple[Cause, ...] = ()
    data_quality: tuple[str | DataQuality, ...] = ()
    confounded: tuple[Confounded, ...] = ()
    schema: str = SCHEMA
    measured: tuple[MeasuredParameter, ...] = ()
    candidates: tuple[Candidate, ...] = ()
    unexplained: Unexplained = field(default_factory=Unexplained)
    calibrated: Mapping[str, CalibratedParameter] = field(default_factory=dict)
    model_file: ModelFile | None = None
    nuisances: Mapping[str, Nuisance] = field(default_factory=dict)
    friction: Mapping[str, ModelledFriction] = field(default_factory=dict)
    balances: Mapping[str, Mapping[str, BalanceResidual]] = field(default_factory=dict)
    detection_limits: Mapping[str, DetectionLimit] = field(default_factory=dict)
    next_test: NextTest | None = None
    errors: Errors | None = None
    gain: Gain | None = None
    diagnosis: Consequence | None = None
    transfer: tuple[Transfer, ...] = ()
    isolations: tuple[Isolation, ...] = ()
    rejected_recordings: tuple[str, ...] = ()
    interrupted: str = ""
    stages: str = ""
    judged_by: str = ""
    runs: tuple[FreeRun, ...] = ()
    starts: Starts | None = None

    @property
    def component(self) -> str:
        """The component that all causes sit in, whichever of them it is.

        The text is empty where they differ, and without a cause.
        """
        found = {one.component for one in self.causes}
        return found.pop() if len(found) == 1 else ""
