"""Contract tests for the parts of plug-ins.

The project's own parts are held to the same ones.

Each function takes a declaration, and raises AssertionError that says what of its contract the part does not keep. A
part need not be installed. Runs are on the virtual bench, in a folder that is removed afterwards.
"""

from __future__ import annotations

import itertools
import tempfile
from collections.abc import Callable, Iterator, Mapping
from contextlib import contextmanager, nullcontext
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING, Any, TypeVar

import numpy as np
import yaml
from pydantic import ValidationError

from etb_hil.api.recordings import Recording
from etb_hil.api.runs import Run, run
from etb_hil.base.errors import InputError, Place
from etb_hil.base.outcome import BenchOutcome
from etb_hil.base.plugins import Part, parts, temporary_part
from etb_hil.base.stock import stock_file
from etb_hil.base.validation import problem_of
from etb_hil.canio.frames import FrameBlock, concatenate_frames
from etb_hil.canio.logs.reading import check_reader_part, read_log
from etb_hil.controller.laws.choice import law_gains
from etb_hil.controller.laws.registry import LAWS
from etb_hil.diagnosis.measurement_registry import check_measurement_part, kind_of, measurement_kinds
from etb_hil.observer.estimate import SensorNoise
from etb_hil.observer.guarded import fault_of
from etb_hil.observer.registry import OBSERVERS, observer_kind
from etb_hil.plant.effects.catalogue import CATALOGUE, check_effect_part
from etb_hil.plant.model_file import EffectEntry
from etb_hil.plant.parameters import load_model
from etb_hil.plant.voltage_run import run_voltage
from etb_hil.scenario.judged_limits import missing_phases
from etb_hil.scenario.phases import kind_name, name_of_part, phase_kinds, read_phase
from etb_hil.uds.keys import check_key_part

if TYPE_CHECKING:
    from etb_hil.canio.logs.log_reader import Reader
    from etb_hil.controller.laws.interface import ControlLaw
    from etb_hil.diagnosis.measurement_kind import MeasurementKind
    from etb_hil.observer.registry import ObserverKind
    from etb_hil.plant.effects.effect import Effect
    from etb_hil.scenario.phase import PhaseModel
    from etb_hil.uds.keys import SecurityKey

__all__ = [
    "check_effect",
    "check_key",
    "check_law",
    "check_measurement",
    "check_observer",
    "check_phase",
    "check_reader",
]

_NAME = "part_under_test"
Declared = TypeVar("Declared")


def check_effect(effect: Effect) -> None:
    """Assert that an effect keeps its contract.

    The effect is nothing at zero strength, and changes a driven plant.
    """
    _declared(check_effect_part, "effects", effect)
    with _refused_as_failure(), _having("effects", effect.id, effect, is_known=effect.id in CATALOGUE):
        model = load_model(stock_file("model", "default"))
        time_ns = np.arange(4000) * 500_000
        voltage = 6.0 * np.sin(9e-9 * time_ns)

        def driven(entry: EffectEntry | None) -> np.ndarray[Any, Any]:
            unit = model if entry is None else replace(model, effects=(entry,))
            return run_voltage(unit, time_ns, voltage, 0.4, 25.0).angle

        plain = driven(None)
        first = {one.name: one.starts[0] if one.starts else 0.0 for one in effect.parameters if one.is_strength}
        absent, present = (driven(_entry(effect, first, steps)) for steps in (0.0, 1.0))
        _same(absent, plain, 1e-6, "at zero strength it changes the angle of a driven plate")
        assert np.isfinite(present).all(), "at the first steps of its strengths a driven plate has no finite angle"


def check_measurement(kind: MeasurementKind, scenario: str | Path = "friction_check") -> None:
    """Assert that a measurement keeps its contract.

    A scenario gives it, and a replay gives it again.

    The scenario must have one of the measurement's phases.
    """
    _declared(check_measurement_part, "measurements", kind)
    is_known = kind.id in measurement_kinds()
    missing = [str(problem) for problem in missing_phases(kind)]
    assert not missing, "\n".join(missing)
    with _refused_as_failure(), _having("measurements", kind.id, kind, is_known=is_known), _run(scenario) as live:
        measured = [one for one in live.measurements.values() if _is_of(one.id, kind)]
        assert measured, f"{scenario} did not give {kind.id}; name a scenario with its phases"
        for one in measured:
            assert one.is_known, f"{one.id} has no value: {one.note}"
            if one.value is None:
                continue
            assert np.isfinite(one.value), f"{one.id} is {one.value}"
            if one.low is not None and one.high is not None:
                inside = one.low <= one.value <= one.high
                assert inside, f"{one.id} = {one.value} lies outside its interval, {one.low} to {one.high}"
        again = Run.open(live.folder).measurements
        assert all(again[one.id] == one for one in measured), f"a replay gives another {kind.id}"


def check_observer(kind: ObserverKind) -> None:
    """Assert that an observer keeps its contract.

    The observer gives the same bits however its stream is cut, and friction has velocity's sign.

    A sample that is not a number must have no estimate and no effect on later ones beyond a tenth of a second.
    """
    _declared(OBSERVERS.check, "observers", kind)
    with _refused_as_failure(), _having("observers", _NAME, kind) as name, _run("friction_check") as live:
        model = load_model(stock_file("model", "default"))
        make = observer_kind(name).make
        time_ns, current, angle = _stream(live.recording, model.values.gear_ratio)

        def estimated(*edges: int, bad: slice = slice(0)) -> dict[str, np.ndarray[Any, Any]]:
            observer, seen = make(model, model.values, SensorNoise.of_bench(model)), current.copy()
            seen[bad] = np.nan
            parts = [observer.push(time_ns[a:b], seen[a:b], angle[a:b]) for a, b in itertools.pairwise(edges)]
            assert (fault := fault_of(observer)) is None, str(fault)
            return {name: np.concatenate([getattr(p, name) for p in parts]) for name in ("velocity", "friction")}

        count = len(time_ns)
        whole = estimated(0, count)
        cut = estimated(0, 1, 2, count // 3, count // 3, count // 2, count)
        for column, values in whole.items():
            assert np.array_equal(values, cut[column], equal_nan=True), f"{column} depends on how the stream is cut"
        moving = np.isfinite(whole["friction"]) & (np.abs(whole["velocity"]) > 0.3)
        assert moving.any(), "it estimated nothing while the plate moved"
        agree = np.mean(np.sign(whole["friction"][moving]) == np.sign(whole["velocity"][moving]))
        assert agree > 0.9, f"friction has the sign of velocity in {agree:.0%} of fast motion only"
        bad = slice(count // 2, count // 2 + 3)
        damaged = estimated(0, count, bad=bad)
        assert np.isnan(damaged["friction"][bad]).all(), "a sample that is not a number has an estimate"
        late = time_ns > time_ns[bad.stop] + 100_000_000
        lost = np.isfinite(whole["friction"]) & ~np.isfinite(damaged["friction"]) & late
        assert not lost.any(), "it does not recover from a sample that is not a number"


def check_key(key: SecurityKey) -> None:
    """Assert that a key function keeps its contract.

    The key function makes the same bytes of a seed each time, and unlocks the virtual controller.
    """
    _declared(check_key_part, "keys", key)
    for length in range(1, 17):
        seed = bytes((37 * k + length) % 256 for k in range(length))
        first, second = key.compute(seed, 1), key.compute(seed, 1)
        assert isinstance(first, bytes), f"the key of a seed of {length} bytes must be bytes"
        assert first, f"the key of a seed of {length} bytes is empty"
        assert first == second, f"two keys of one seed of {length} bytes differ"
    with _refused_as_failure(), _having("keys", _NAME, key) as name, tempfile.TemporaryDirectory() as folder:
        stock = yaml.safe_load(stock_file("bench", "virtual_uds").read_text("utf-8"))
        stock["uds"]["security"]["key"] = name
        bench = Path(folder) / "bench.yaml"
        bench.write_text(yaml.safe_dump(stock, sort_keys=False), "utf-8")
        with _run("friction_check", bench) as live:
            _require_well(live)


def check_law(law: ControlLaw) -> None:
    """Assert that a position law keeps its contract.

    The law compiles, stays finite, and carries a friction check on the virtual bench.
    """
    _declared(LAWS.check, "laws", law)
    own = next((name for name, one in LAWS.all_own().items() if one is law), None)
    with _refused_as_failure(), _having("laws", own or _NAME, law, is_known=own is not None) as name:
        gains = law_gains(name, load_model(stock_file("model", "default")).values)
        assert gains.any(), "all its gains are zero"
        with tempfile.TemporaryDirectory() as folder:
            stock = yaml.safe_load(stock_file("bench", "virtual_classic").read_text("utf-8"))
            bench = Path(folder) / "bench.yaml"
            bench.write_text(yaml.safe_dump({**stock, "law": name}, sort_keys=False), "utf-8")
            with _run("friction_check", bench) as live:
                _require_well(live)


def check_phase(phase: type[PhaseModel], settings: Mapping[str, object]) -> None:
    """Assert that a kind of phase keeps its contract.

    The kind of phase gives finite set-points, the same each time, and runs on the virtual bench.

    `settings` are its keys in a scenario, without `kind` and `id`.
    """
    name = _declared(name_of_part, "phases", phase)
    assert isinstance(settings, Mapping), f"the settings of a phase must be a mapping (they are {settings!r})"
    known = {kind_name(one) for one in phase_kinds().values()}
    with _refused_as_failure(), _having("phases", _NAME, phase, is_known=name in known):
        entry = {"kind": name, "id": "part", **settings}
        throttle = load_model(stock_file("model", "default")).values
        try:
            one, other = (read_phase(entry).trajectory(throttle.limp_home, throttle) for _ in range(2))
        except ValidationError as error:
            found = error.errors(include_url=False)
            said = [str(problem_of(one, Place(key=".".join(map(str, one["loc"]))))) for one in found]
            raise AssertionError("; ".join(said)) from error
        instants = np.arange(0.0, one.duration, 1e-3)
        points = [one.at(float(t)) for t in instants]
        assert np.isfinite([[p.position, p.velocity, p.voltage] for p in points]).all(), "a set-point is not finite"
        # Compared before it is asserted: where pytest shows how two long lists differ, it takes many minutes in CI.
        same = points == [other.at(float(t)) for t in instants]
        assert same, "its set-points differ from call to call"
        with tempfile.TemporaryDirectory() as folder:
            scenario = Path(folder) / "scenario.yaml"
            zero = {"kind": "current_zero", "id": "zero", "duration": "0.5 s"}
            content = {"schema": "etb_hil/scenario/1", "name": "part", "phases": [zero, entry]}
            scenario.write_text(yaml.safe_dump(content, sort_keys=False, allow_unicode=True), "utf-8")
            with _run(scenario) as live:
                _require_well(live)


def check_reader(reader: Reader, path: str | Path) -> None:
    """Assert that a reader keeps its contract.

    The reader gives a file's frames, the same each time, and of a file cut short those before the cut.
    """
    _declared(check_reader_part, "readers", reader)
    assert isinstance(path, str | Path), f"the path must be a text or a path (it is {path!r})"
    path = Path(path)
    with _refused_as_failure(), _having("readers", _NAME, reader), tempfile.TemporaryDirectory() as folder:
        log = read_log(path)
        whole = _frames(log)
        assert len(whole), f"{path} gave no frame: {log.notes}"
        assert not log.notes, f"{path} is to be a sound file; its reader says: {log.notes}"
        _require_same(whole, _frames(log), "reading it again gives other frames")
        for share in (0.3, 0.7):
            cut = Path(folder) / f"cut{path.suffix}"
            content = path.read_bytes()
            cut.write_bytes(content[: int(share * len(content))])
            try:
                part = _frames(read_log(cut))
            except InputError:
                continue
            _require_same(
                whole.select(slice(0, len(part))), part, "a file cut short gives other frames than the whole one"
            )


def _declared(check: Callable[[Part], Declared], kind: str, declaration: object) -> Declared:
    """Return what a registry's check of a declaration returns.

    AssertionError where it refuses the declaration.
    """
    with _refused_as_failure():
        return check(Part(kind, _NAME, declaration, Place("a test")))


def _entry(effect: Effect, first: Mapping[str, float], steps: float) -> EffectEntry:
    units = {one.name: one.unit for one in effect.parameters}
    stated = {k: steps * v if units[k] == "1" else f"{steps * v!r} {units[k]}" for k, v in first.items()}
    return EffectEntry(id=effect.id, strengths=stated)


@contextmanager
def _refused_as_failure() -> Iterator[None]:
    try:
        yield
    except InputError as error:
        raise AssertionError(str(error)) from error


@contextmanager
def _having(kind: str, name: str, part: object, *, is_known: bool = False) -> Iterator[str]:
    """Have a part for as long as the block runs, and yield its name.

    One that is installed keeps its own.
    """
    installed = next((one.name for one in parts(kind) if one.value is part), name if is_known else None)
    with nullcontext() if installed else temporary_part(kind, name, part):
        yield (installed or name).replace("_", "-")


@contextmanager
def _run(scenario: str | Path, bench: str | Path = "virtual_classic") -> Iterator[Run]:
    with tempfile.TemporaryDirectory() as folder:
        yield run(scenario, bench=bench, folder=folder)


def _require_well(live: Run) -> None:
    bench = live.result.bench
    assert bench.outcome is BenchOutcome.OK, f"the run ended with a bench fault: {bench.reason}"


def _is_of(measurement_id: str, kind: MeasurementKind) -> bool:
    known = kind_of(measurement_id)
    return known is not None and known.id == kind.id


def _stream(recording: Recording, gear_ratio: float) -> tuple[np.ndarray[Any, Any], ...]:
    time_ns, columns = recording.table(["motor_current", "motor_angle"])
    both = np.isfinite(columns["motor_current"]) & np.isfinite(columns["motor_angle"])
    return time_ns[both], columns["motor_current"][both], columns["motor_angle"][both] / gear_ratio


def _same(found: np.ndarray[Any, Any], expected: np.ndarray[Any, Any], within: float, what: str) -> None:
    worst = float(np.abs(found - expected).max())
    assert worst <= within, f"{what} (by {worst:.3g} rad; allowed: {within:g} rad)"


def _frames(log: Any) -> FrameBlock:  # noqa: ANN401 (any LogReader)
    return concatenate_frames(list(log))


def _require_same(expected: FrameBlock, found: FrameBlock, what: str) -> None:
    for name in ("stamp_ns", "ident", "length", "data", "channel"):
        assert np.array_equal(getattr(expected, name), getattr(found, name)), f"{what} ({name})"
