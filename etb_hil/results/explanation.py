"""The result of `explain`, typed.

The result says what the model lacks of a measurement, why, and how well that is known.

`explanation.json` holds these fields. Values are SI; intervals are 95 %. What is not known is None.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import ClassVar

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

    __pydantic_config__: ClassVar[Mapping[str, bool]] = {"use_attribute_docstrings": True}  # of the nested types, too

    verdict: str
    """adequate, explained, ambiguous, unexplained or insufficient_data."""
    causes: tuple[Cause, ...] = ()
    """Accepted causes."""
    data_quality: tuple[str | DataQuality, ...] = ()
    """Quality of each segment; a sentence where data could not be used."""
    confounded: tuple[Confounded, ...] = ()
    """Conditions that changed together."""
    schema: str = SCHEMA
    """Schema of the file."""
    measured: tuple[MeasuredParameter, ...] = ()
    """Parameters that were measured at the bench."""
    candidates: tuple[Candidate, ...] = ()
    """Candidates of every selection step."""
    unexplained: Unexplained = field(default_factory=Unexplained)
    """Residual that no cause explains."""
    calibrated: Mapping[str, CalibratedParameter] = field(default_factory=dict)
    """Base parameters as fitted, by name."""
    model_file: ModelFile | None = None
    """Origin of the values in the written model file."""
    nuisances: Mapping[str, Nuisance] = field(default_factory=dict)
    """Parameters of the measurement, by name."""
    friction: Mapping[str, ModelledFriction] = field(default_factory=dict)
    """Friction torques by measurement id."""
    balances: Mapping[str, Mapping[str, BalanceResidual]] = field(default_factory=dict)
    """Residuals by balance and regime."""
    detection_limits: Mapping[str, DetectionLimit] = field(default_factory=dict)
    """Smallest detectable strengths by effect."""
    next_test: NextTest | None = None
    """Test that distinguishes the open hypotheses."""
    errors: Errors | None = None
    """Errors on data that no fit used."""
    gain: Gain | None = None
    """Reduction of the free-run error."""
    diagnosis: Consequence | None = None
    """What the causes change in the diagnosis."""
    transfer: tuple[Transfer, ...] = ()
    """Whether other recordings show the causes."""
    isolations: tuple[Isolation, ...] = ()
    """Ids that left ambiguity groups."""
    rejected_recordings: tuple[str, ...] = ()
    """Reasons why other recordings were not used."""
    interrupted: str = ""
    """Work that an interrupt ended; empty if none did."""
    stages: str = ""
    """Stages that were complete by then."""
    judged_by: str = ""
    """Data that the verdict rests on, where it is slow."""
    runs: tuple[FreeRun, ...] = ()
    """Runs of slow data."""
    starts: Starts | None = None
    """Starts of the fit in free run."""

    @property
    def component(self) -> str:
        """The component that all causes sit in, whichever of them it is.

        The text is empty where they differ, and without a cause.
        """
        found = {one.component for one in self.causes}
        return found.pop() if len(found) == 1 else ""
