"""A run from files to results.

All is read and checked first, then the scenario runs, then the unit is judged.
"""

from __future__ import annotations

from collections.abc import Callable
from contextlib import ExitStack
from dataclasses import dataclass, replace
from pathlib import Path
from typing import TYPE_CHECKING

from etb_hil.base.clock import Clock, WallClock
from etb_hil.base.errors import InputError, Problem, RecordingFault
from etb_hil.base.outcome import BenchOutcome
from etb_hil.base.steady import steady
from etb_hil.base.stock import stock_file
from etb_hil.base.yamlfile import Document
from etb_hil.bench.bench_file import BenchSetup, load_bench, load_plugins
from etb_hil.bench.controller_lock import bench_lock
from etb_hil.bench.expected_unit import ExpectedUnit
from etb_hil.bench.operator import Operator, check_unattended
from etb_hil.bench.preflight import check_scenario
from etb_hil.bench.rehearsal import rehearse_once
from etb_hil.bench.results import results_of
from etb_hil.bench.runner import Runner
from etb_hil.bench.snapshot import Watcher, nobody
from etb_hil.bench.stop_signals import StopSignals
from etb_hil.bench.tap import Tap
from etb_hil.canio.bus.bus_settings import SOCKETCAN, VIRTUAL
from etb_hil.canio.bus.link import Link, VirtualLink, open_link
from etb_hil.canio.bus.virtual_network import VirtualNetwork
from etb_hil.canio.dbc.commands import CommandEncoder
from etb_hil.canio.logs.blf import BlfLog
from etb_hil.controller.frame_writer import require_bursts_at_its_rate
from etb_hil.controller.virtual_controller import VirtualController
from etb_hil.diagnosis.limits import Limits
from etb_hil.observer.registry import OBSERVERS
from etb_hil.plant.parameters import Model, load_model
from etb_hil.scenario.judged_limits import load_judged_limits
from etb_hil.scenario.scenario_file import Scenario, load_scenario
from etb_hil.session.analysis import Analysis
from etb_hil.session.attempts import earlier_attempts, is_tried_again, set_aside
from etb_hil.session.events import EventLog
from etb_hil.session.finished import Finished
from etb_hil.session.photos import keep_photos
from etb_hil.session.session import Session, create
from etb_hil.store.address import STORE, StoreAddress, store_address
from etb_hil.store.queue import Queue

if TYPE_CHECKING:
    from etb_hil.bench.unit_talk import UnitTalk
    from etb_hil.canio.bus.budget import BusBudget
    from etb_hil.results.run_result import RunResult


# What a bench runs that own code commands step by step.
OWN_CODE = Document(
    Path("own code"), Scenario.model_construct(schema_="etb_hil/scenario/1", name="own code", phases=()), {}
)


@dataclass(frozen=True, slots=True)
class JobFiles:
    """The files of a run; without a `scenario`, own code commands.

    `unit` is the virtual unit's model, which only the virtual controller reads. Without a `unit`, the virtual one is
    the stock default; without a `dbc`, it is the one that the bench file names. A `station` file is kept with the
    session, and `expected` is what it says of the unit. An `observer` takes the place of the bench file's, and so
    does a `store`.
    """

    scenario: Path | None
    bench: Path
    model: Path
    limits: Path
    unit: Path | None = None
    dbc: Path | None = None
    station: Path | None = None
    observer: str | None = None
    expected: ExpectedUnit | None = None
    store: StoreAddress | None = None


@dataclass(frozen=True, slots=True)
class Job:
    """Files that were read and found to fit together.

    `serial` is the unit's, once it is known.
    """

    files: JobFiles
    scenario: Document[Scenario]
    setup: BenchSetup
    model: Model
    limits: Limits
    unit: Model
    budgets: list[BusBudget]
    serial: str = ""

    @property
    def observer(self) -> str:
        """The name of the observer that estimates friction."""
        return self.files.observer or self.setup.bench.observer

    @property
    def is_virtual(self) -> bool:
        """Whether the virtual controller of the bench is in this process."""
        return self.setup.bench.bus.interface == VIRTUAL

    def store(self, sessions: Path) -> StoreAddress:
        """Return where results go to.

        The place is the store that the files name, or the one in the folder of sessions.
        """
        return self.files.store or bench_store(self.setup, sessions)


def prepare(files: JobFiles, *, attended: bool = False) -> Job:
    """Read and check all files of a run, before anything moves.

    InputError lists what is wrong.

    `attended` says that somebody is there to answer the scenario's prompts.
    """
    load_plugins(files.bench)
    if files.observer is not None:
        OBSERVERS.require(files.observer)
    scenario = OWN_CODE if files.scenario is None else load_scenario(files.scenario)
    setup = load_bench(files.bench, files.dbc)
    model = load_model(files.model)
    limits = load_judged_limits(files.limits, model.values.gear_ratio)
    if files.unit is not None and setup.bench.bus.interface != VIRTUAL:
        raise InputError(
            Problem(
                "a virtual unit was given to a bench with a real bus",
                setup.document.place("bus", "interface"),
                setup.bench.bus.interface,
                VIRTUAL,
                "leave --unit out: the unit is what is plugged in",
            )
        )
    if setup.bench.bus.interface not in {VIRTUAL, SOCKETCAN}:
        from etb_hil.canio.bus.python_can_link import require_interface  # noqa: PLC0415 (importing can is slow)

        require_interface(setup.bench.bus, setup.document.place("bus", "interface"))
    if setup.bench.bus.interface == VIRTUAL:
        require_bursts_at_its_rate(setup.dialect)
    unit = load_model(files.unit or stock_file("model", "default"))
    if not attended:
        check_unattended(scenario)
    budgets = check_scenario(scenario, setup, model.values)
    if files.scenario is not None:
        rehearse_once(scenario, setup.bench, model, limits)
    return Job(files, scenario, setup, model, limits, unit, budgets)


def execute(
    job: Job,
    folder: Path,
    serial: str,
    seed: int,
    watcher: Watcher = nobody,
    operator: Operator | None = None,
    signals: StopSignals | None = None,
    runner: Callable[..., Runner] | None = None,
) -> Finished:
    """Run the scenario and judge the unit; return the attempt that counts.

    The scenario is tried again where the scenario wants it.

    The session lies in a new folder under `folder`. Raises BenchFault where somebody else sends its commands.
    From the moment at which the run begins `signals` are held; whoever gives them lets them go. For who gives none, an
    order that comes once the run is over is a KeyboardInterrupt, as soon as its results are written. `runner` makes
    what runs the steps, where that is none of scenarios.
    """
    inputs = {
        **({} if job.files.scenario is None else {"scenario": job.files.scenario}),
        "bench": job.files.bench,
        "model": job.files.model,
        "limits": job.files.limits,
        "dbc": job.setup.dbc,
    }
    if job.files.station is not None:
        inputs["station"] = job.files.station
    if job.is_virtual:
        inputs["unit"] = job.files.unit or stock_file("model", "default")
    with ExitStack() as held:
        if not job.is_virtual:
            held.enter_context(bench_lock(job.setup))
            held.enter_context(steady())
        heard = StopSignals() if signals is None else signals
        if signals is None:
            held.callback(heard.let_go)
        noise = seed if job.is_virtual else None
        session = create(
            folder,
            job.scenario.content.name,
            serial,
            inputs,
            model=job.model.name,
            seed=noise,
            observer=job.observer,
        )
        job = replace(job, serial=serial)
        attempt, spent_ns = 1, 0
        warnings: list[str] = []
        while True:
            finished = _attempt(job, session, seed, attempt, spent_ns, watcher, operator, heard, runner)
            lasted_ns = finished.record.end_ns - finished.record.start_ns
            spent_ns += lasted_ns
            warnings += finished.warnings
            has_room = (spent_ns + lasted_ns) * 1e-9 <= job.setup.bench.limits.duration
            if not (has_room and is_tried_again(job.scenario.content.retry, finished.results, attempt)):
                break
            try:
                set_aside(session, attempt)
            except OSError as error:
                warnings.append(f"attempt {attempt} counts: its files cannot be set aside for another one ({error})")
                break
            attempt += 1
        try:
            finished = _counted(finished)
        except RecordingFault as error:
            warnings.append(f"the results do not name the attempts before: {error}")
        finished = replace(finished, warnings=tuple(warnings))
    if signals is None and finished.record.outcome is not BenchOutcome.ABORTED:
        heard.raise_if_late()
    return finished


def _counted(finished: Finished) -> Finished:
    """Write into the results of the attempt that counts what came of those before it."""
    earlier = earlier_attempts(finished.session)
    if earlier:
        finished = replace(finished, results=replace(finished.results, attempts=earlier))
        finished.session.write_results(finished.results)
    return finished


def _attempt(
    job: Job,
    session: Session,
    seed: int,
    attempt: int,
    spent_ns: int,
    watcher: Watcher,
    operator: Operator | None,
    signals: StopSignals,
    runner: Callable[..., Runner] | None,
) -> Finished:
    scenario = job.scenario.content
    with ExitStack() as open_things:
        link, clock = connect(job, seed + attempt - 1)
        open_things.callback(link.close)
        log = BlfLog(session.raw_log, clock.now_ns())
        open_things.callback(log.close)
        events = EventLog(session.events)
        open_things.callback(events.close)
        analysis = Analysis(
            job.setup.dialect,
            job.model,
            job.limits,
            str(session.folder),
            observer=job.observer,
            bus=job.setup.bench.bus,
        )
        encoder = CommandEncoder(job.setup.dialect)
        tap = Tap(link, encoder, analysis, log, events, clock, _talk(job, clock))
        signals.hold()  # until the results are written, at least: what hangs before may be interrupted
        record = (runner or Runner)(
            job.setup.bench,
            scenario.steps,
            analysis,
            tap,
            clock,
            supply=scenario.supply_guard,
            operator=operator,
            watcher=watcher,
            signals=signals,
            spent_ns=spent_ns,
        ).run()
        found = analysis.finish(complete=record.is_complete)
        try:
            events.close()
            log.close()  # which completes its header: the checksums are of files that nobody writes to any more
        except RecordingFault as fault:
            record.miss_frames(str(fault))
        results = results_of(session, job.setup.bench, job.limits, record, analysis, found)
        session.write_results(results)
        run_id = session.run_id if attempt == 1 else f"{session.run_id}_attempt-{attempt}"
        warnings = (*keep_photos(session.folder, record.answers), *_queued(session, results, run_id))
    return Finished(session, results, record, analysis, found, warnings)


def _queued(session: Session, results: RunResult, run_id: str) -> tuple[str, ...]:
    try:
        Queue(session.folder.parent).add(results, session.folder, run_id)
    except InputError as error:
        return (f"the store of results lacks this run: {error}; the session holds everything",)
    return ()


def bench_store(setup: BenchSetup, sessions: Path) -> StoreAddress:
    """Return the store that a bench file names, or the one in the folder of sessions."""
    named = setup.bench.store
    return StoreAddress(sessions / STORE) if named is None else store_address(named, setup.document.path)


def deliver(job: Job, sessions: Path) -> tuple[str, ...]:
    """Write the runs that wait in a folder of sessions into the store.

    Return what went wrong, a sentence each.

    To be called once the verdict was said: a server that does not answer takes some seconds.
    """
    return Queue(sessions).deliver(job.store(sessions)).warnings


def _talk(job: Job, clock: Clock) -> UnitTalk | None:
    settings = job.setup.bench.uds
    if settings is None:
        return None
    from etb_hil.bench.unit_talk import UnitTalk  # noqa: PLC0415 (a bench without UDS starts without it)

    expected = job.files.expected
    return UnitTalk(settings, clock, expected and replace(expected, serial=job.serial))


def connect(job: Job, seed: int) -> tuple[Link, Clock]:
    """Open the bench's bus.

    On the virtual one, switch the virtual controller with its unit on.
    """
    bench = job.setup.bench
    if not job.is_virtual:
        clock = WallClock()
        return open_link(bench.bus, clock), clock
    network = VirtualNetwork(int(bench.bus.bitrate), int(bench.bus.data_bitrate), fd=bench.bus.fd)
    identity = {"part_number": job.limits.part_number} | ({"serial": job.serial} if job.serial else {})
    controller = VirtualController(
        job.unit, job.setup.dialect, seed, nominal=job.model, law=bench.law or "pd", uds=bench.uds, identity=identity
    )
    network.attach(controller, controller.sends)
    return VirtualLink(network), network.clock
