"""pytest on a throttle bench: fixtures and markers.

The fixtures are `etb_bench` and `etb_run`; the markers say what they run.

    @pytest.mark.etb_scenario("friction_check", unit="faulty")
    @pytest.mark.etb_limits("limits.yaml")
    def test_the_unit_sticks(etb_run):
        assert etb_run.verdict == "fail"

After each test the health of the bus in every run is asserted. A bench that failed, a sick bus too, is an error of
the test's surroundings and no failure of the unit's test. This module loads nothing until a fixture is asked for.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any

import pytest

if TYPE_CHECKING:
    from etb_hil.results.measurement import Measurement
    from etb_hil.results.run_result import RunResult

SCENARIO, LIMITS = "etb_scenario", "etb_limits"
DEFAULTS = {"scenario": "friction_check", "bench": "virtual_classic", "model": "default", "limits": "default"}


def pytest_addoption(parser: pytest.Parser) -> None:
    """Add the options and the settings of `pytest.ini`."""
    group = parser.getgroup("etb-hil", "throttle bench (etb-hil)")
    group.addoption("--etb-bench", metavar="BENCH", help="bench file or stock name, in place of the setting etb_bench")
    group.addoption("--etb-seed", metavar="SEED", type=int, help="seed of the virtual unit's noise, for every run")
    group.addoption("--etb-sessions", metavar="FOLDER", help="keep the sessions here (default: pytest's own temporary)")
    for name, default in DEFAULTS.items():
        parser.addini(f"etb_{name}", f"{name} file or stock name (default: {default})", default=default)


def pytest_configure(config: pytest.Config) -> None:
    """Tell pytest of the markers."""
    config.addinivalue_line(
        "markers", f"{SCENARIO}(scenario, unit=, model=, serial=, seed=): what etb_run and etb_bench.run run"
    )
    config.addinivalue_line("markers", f"{LIMITS}(limits): the limits by which the unit is judged")


@dataclass(frozen=True, slots=True)
class BenchRun:
    """A run that was judged: its results, and the session's folder."""

    results: RunResult
    session: Path

    @property
    def verdict(self) -> str:
        """What is said of the unit: `pass`, `fail` or `inconclusive`."""
        return str(self.results.unit.verdict)

    @property
    def reason(self) -> str:
        """Why, in a sentence."""
        from etb_hil.report.verdict import verdict_of

        return verdict_of(self.results).reason

    def number(self, name: str) -> Measurement:
        """Return a measured number by its id in `results.json`, as `T_st`.

        LookupError names those that there are.
        """
        found = self.results.measurements.get(name)
        if found is None:
            there = ", ".join(self.results.measurements)
            raise LookupError(f"the run has no number '{name}'; it has: {there}")
        return found

    def value(self, name: str) -> float:
        """Return the value of a number, in the SI unit that it is listed with.

        LookupError where it has none.
        """
        from etb_hil.results import shown

        found = self.number(name)
        if found.value is None:
            known = f": it is known to be {shown.measured(found)}" if found.is_bound else ""
            raise LookupError(f"'{name}' was not measured in this run{known}")
        return found.value


class EtbBench:
    """Runs scenarios for one test.

    Files are paths, also beside the test's module, or names of stock files.
    """

    def __init__(self, request: pytest.FixtureRequest, sessions: Path) -> None:
        self._node: Any = request.node
        self._config = request.config
        self._sessions = sessions
        self.runs: list[BenchRun] = []

    def run(self, scenario: str | None = None, **changes: Any) -> BenchRun:  # noqa: ANN401 (of several types)
        """Run a scenario, by default the marked one, and return what came of it.

        `changes` are `unit`, `model`, `limits`, `serial` and `seed`, in place of the markers'. Raises InputError where
        a file is wrong, BenchFault where the bench failed, KeyboardInterrupt where somebody stopped the run.
        """
        from etb_hil.base.errors import BenchFault
        from etb_hil.base.outcome import BenchOutcome
        from etb_hil.bench.job import deliver, execute, prepare
        from etb_hil.report.verdict import verdict_text

        settings = self._settings(scenario, changes)
        job = prepare(self._files(settings))
        finished = execute(job, self._sessions, str(settings["serial"]), int(settings["seed"]))
        results = finished.results
        late = deliver(job, self._sessions)
        self._node.add_report_section("call", "etb-hil", "\n".join([verdict_text(results), *finished.warnings, *late]))
        if results.bench.outcome is BenchOutcome.ABORTED:
            raise KeyboardInterrupt(results.bench.reason)
        if results.bench.outcome is BenchOutcome.FAULT:
            raise BenchFault(f"{results.bench.reason} (session {finished.session.folder})")
        run = BenchRun(results, finished.session.folder)
        self.runs.append(run)
        self._node.user_properties += _properties(run)
        return run

    def _settings(self, scenario: str | None, changes: dict[str, Any]) -> dict[str, Any]:
        """Return what is to be run.

        What the call says comes before the markers, and these before the settings.
        """
        settings: dict[str, Any] = {name: self._config.getini(f"etb_{name}") for name in DEFAULTS}
        settings |= {"unit": None, "serial": "", "seed": 1}
        for marker, key in ((SCENARIO, "scenario"), (LIMITS, "limits")):
            if (found := self._node.get_closest_marker(marker)) is not None:
                settings |= dict(zip((key,), found.args, strict=False)) | found.kwargs
        settings |= changes | ({} if scenario is None else {"scenario": scenario})
        for option in ("bench", "seed"):
            if (given := self._config.getoption(f"etb_{option}")) is not None:
                settings[option] = given
        if unknown := settings.keys() - {*DEFAULTS, "unit", "serial", "seed"}:
            raise pytest.UsageError(f"etb-hil knows no {', '.join(sorted(unknown))} of a run")
        return settings

    def _files(self, settings: dict[str, Any]) -> Any:  # noqa: ANN401 (its module is not loaded yet)
        from etb_hil.base.stock import find
        from etb_hil.bench.job import JobFiles

        beside = Path(str(self._node.path))
        paths = {name: find(name, str(settings[name]), beside) for name in DEFAULTS}
        unit = settings["unit"]
        virtual = None if unit is None else find("model", str(unit), beside)
        return JobFiles(paths["scenario"], paths["bench"], paths["model"], paths["limits"], virtual)

    def assert_bus_health(self) -> None:
        """Raise AssertionError where a run's bus or end was not sound.

        That is a sick bus, or a drive that was not seen to be off.
        """
        found = [f"{run.session.name}: {', '.join(sick)}" for run in self.runs if (sick := complaints(run.results))]
        assert not found, "the bus was not healthy: " + "; ".join(found)  # noqa: S101 (what a test is for)


def complaints(results: RunResult) -> list[str]:
    """Return what was wrong with the bus in a run.

    What nobody could measure is not wrong.
    """
    bus = results.bus
    counts: list[tuple[str, int | None]] = [("error frames", bus.error_frames), ("frames dropped", bus.dropped)]
    for message in bus.messages:
        counts += [
            (f"frames of {message.name} lost", message.lost),
            (f"bad CRC in {message.name}", message.crc_failures),
        ]
    found = [f"{count} {what}" for what, count in counts if count]
    if bus.state not in (None, "error-active"):
        found.append(f"the interface is {bus.state}")
    if results.bench.safe_state is False:
        found.append("the drive was not seen to be off")
    return found


def _properties(run: BenchRun) -> list[tuple[str, object]]:
    from etb_hil.results import shown

    results = run.results
    known = [(one.id, shown.measured(one) if one.value is None else one.value) for one in results.judged]
    return [
        ("serial", results.unit.serial),
        ("verdict", run.verdict),
        *known,
        ("bus_load_peak", results.bus.load_peak),
        ("bench", results.bench.name),
        ("model", results.model),
        ("seed", results.seed),
        ("session", str(run.session)),
    ]


@pytest.fixture
def etb_bench(request: pytest.FixtureRequest, tmp_path: Path) -> Iterator[EtbBench]:
    """Give the test a bench.

    After the test, the health of the bus in all its runs is asserted.
    """
    kept = request.config.getoption("etb_sessions")
    bench = EtbBench(request, tmp_path / "sessions" if kept is None else Path(kept))
    yield bench
    bench.assert_bus_health()


@pytest.fixture
def etb_run(etb_bench: EtbBench) -> BenchRun:
    """Run the marked scenario before the test.

    A bench that fails is then an error, and the test has not failed.
    """
    return etb_bench.run()
