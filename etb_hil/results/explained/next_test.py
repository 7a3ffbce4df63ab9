"""The next test in the result of `explain`: a scenario and bench measurements."""

from __future__ import annotations

from dataclasses import dataclass


@dataclass(frozen=True, slots=True)
class Separation:
    """By how much a test would distinguish a cause from others.

    `isolated` are the ids that the test distinguishes from the cause, `not_isolated` the others.
    """

    value: float | None
    unit: str
    isolated: tuple[str, ...]
    not_isolated: tuple[str, ...]


@dataclass(frozen=True, slots=True)
class RequiredParameter:
    """A parameter to be measured at the bench, to within `uncertainty`."""

    name: str
    uncertainty: float
    unit: str
    shaft: str | None = None


@dataclass(frozen=True, slots=True)
class BenchStep:
    """A bench measurement, and the parameters that it gives."""

    instruction: str
    parameters: tuple[RequiredParameter, ...]


@dataclass(frozen=True, slots=True)
class NextTest:
    """The test that distinguishes the causes of a `pair`.

    `scenario` is the stock one to run, if any.
    """

    text: str
    pair: tuple[str, str]
    scenario: str | None = None
    separation_here: float | None = None
    expected_separation: Separation | None = None
    bench_steps: tuple[BenchStep, ...] = ()
