"""Sessions and logs judged again, one or a hundred thousand.

One that cannot be read costs only itself.
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Mapping
from dataclasses import dataclass, field
from pathlib import Path
from typing import TYPE_CHECKING

from etb_hil.api.arguments import checked
from etb_hil.base.errors import InputError, Problem
from etb_hil.results.measurement import Measurement, Measurements

if TYPE_CHECKING:
    from etb_hil.base.outcome import UnitVerdict
    from etb_hil.replays.outcome import Outcome


@dataclass(frozen=True, slots=True)
class Replayed:
    """What came of one source.

    `verdict` is None where the bench failed, the run was aborted, or, with an `error`, the source could not be judged.
    `measurements` are values in SI with their 95 % intervals, by id; empty with an `error`. They have neither limits
    nor verdicts of their own: `Run.open` gives those. `differs` says where a session first differs from its live run.
    """

    path: Path
    verdict: UnitVerdict | None = None
    reason_id: str = ""
    reason: str = ""
    error: str = ""
    differs: str = ""
    serial: str = ""
    measurements: Measurements = field(default_factory=Measurements)


@checked
def replay(
    sources: str | Path | Iterable[str | Path],
    *,
    bench: str | Path = "virtual_classic",
    model: str | Path | None = None,
    limits: str | Path | None = None,
    observer: str | None = None,
    channel: int | None = None,
    jobs: int = 1,
    dask: str | None = None,
) -> Iterator[Replayed]:
    """Judge each source, and yield what came of it as it comes.

    A source is a session's folder or a CAN log.

    A session is judged by its own files where none are given; a log by `bench`, `model` and `limits`, the last two by
    default the stock ones, on a `channel` (from 0) or all. `jobs` processes work side by side, or the workers of the
    `dask` scheduler at an address. A script calls it with `jobs` above 1 under `if __name__ == "__main__":`, since each
    process imports the script. Raises InputError where a file to judge by is wrong, before the first one is judged.
    """
    from etb_hil.base.stock import find, stock_file
    from etb_hil.bench.bench_file import load_plugins
    from etb_hil.replays.many_logs import judge_task, tasks_for
    from etb_hil.replays.session_replay import RuleFiles
    from etb_hil.replays.workers import DaskWorkers, LocalProcesses

    if jobs < 1:
        raise InputError(Problem("jobs: so many processes cannot work", value=jobs, allowed="1 or more"))
    paths = [Path(one) for one in ([sources] if isinstance(sources, str | Path) else sources)]
    own_model = None if model is None else find("model", str(model))
    own_limits = None if limits is None else find("limits", str(limits))
    files = RuleFiles(
        find("bench", str(bench)),
        own_model or stock_file("model", "default"),
        own_limits or stock_file("limits", "default"),
        observer=observer,
    )
    load_plugins(files.bench)
    tasks = tasks_for(paths, [(files, channel)], own_model, own_limits, observer=observer)
    if dask is not None:
        outcomes = DaskWorkers(dask)(tasks)
    else:
        outcomes = LocalProcesses(jobs)(tasks) if jobs > 1 else map(judge_task, tasks)
    return map(_replayed, outcomes)


def _replayed(outcome: Outcome) -> Replayed:
    from etb_hil.base.outcome import UnitVerdict

    path, judged = Path(outcome.path), outcome.judged
    if judged is None:
        return Replayed(path, error=outcome.error or outcome.status)
    return Replayed(
        path,
        None if judged.verdict is None else UnitVerdict(judged.verdict),
        judged.reason_id,
        judged.reason,
        differs=outcome.differs or "",
        serial=judged.serial,
        measurements=_measurements(judged.measurements),
    )


def _measurements(found: Mapping[str, tuple[float | None, float | None, float | None]]) -> Measurements:
    from etb_hil.diagnosis.measurement_registry import kind_of, name_of

    kinds = {id_: kind_of(id_) for id_ in found}
    units = {id_: "" if kind is None else kind.unit for id_, kind in kinds.items()}
    return Measurements(
        Measurement(id_, name_of(id_), value, units[id_], low, high) for id_, (value, low, high) in found.items()
    )
