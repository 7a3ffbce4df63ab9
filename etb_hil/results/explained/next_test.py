"""The next test in the result of `explain`: a scenario and bench measurements."""

from __future__ import annotations

from dataclasses import dataclass


@dataclass(frozen=True, slots=True)
class Separation:
    """By how much a test would distinguish a cause from others.

    `isolated` are the ids that the test distinguishes from the cause, `not_isolated` the others.
    """

    value: float | None
    """Separation in standard deviations; null where it is unknown."""
    unit: str
    """Unit of `value`."""
    isolated: tuple[str, ...]
    """Ids that the test distinguishes from the cause."""
    not_isolated: tuple[str, ...]
    """Ids that it does not."""


@dataclass(frozen=True, slots=True)
class RequiredParameter:
    """A parameter to be measured at the bench, to within `uncertainty`."""

    name: str
    """Name of the parameter."""
    uncertainty: float
    """Largest uncertainty of the measurement."""
    unit: str
    """Unit of `uncertainty`."""
    shaft: str | None = None
    """Shaft at which to measure; null if it has none."""


@dataclass(frozen=True, slots=True)
class BenchStep:
    """A bench measurement, and the parameters that it gives."""

    instruction: str
    """What to do."""
    parameters: tuple[RequiredParameter, ...]
    """Parameters that the measurement gives."""


@dataclass(frozen=True, slots=True)
class NextTest:
    """The test that distinguishes the causes of a `pair`.

    `scenario` is the stock one to run, if any.
    """

    text: str
    """The test as a sentence."""
    pair: tuple[str, str]
    """Ids of the two causes to distinguish."""
    scenario: str | None = None
    """Stock scenario to run; null if none is needed."""
    separation_here: float | None = None
    """Separation of the pair in the explained recording."""
    expected_separation: Separation | None = None
    """Separation that the test is expected to reach."""
    bench_steps: tuple[BenchStep, ...] = ()
    """Bench measurements."""
