"""Check what own code asks for before it moves anything.

Also what a run says so far.
"""

from __future__ import annotations

import json
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
from pydantic import ValidationError

from etb_hil.base.errors import InputError, Place, Problem
from etb_hil.base.nearest import did_you_mean
from etb_hil.base.validation import problem_of
from etb_hil.base.yamlfile import Document
from etb_hil.bench.preflight import check_scenario
from etb_hil.bench.rehearsal import rehearse
from etb_hil.scenario.phases import phase_kinds, read_phase
from etb_hil.scenario.scenario_file import Scenario

if TYPE_CHECKING:
    from pydantic_core import ErrorDetails

    from etb_hil.api.runs import Run
    from etb_hil.bench.job import Job

_SOURCE = Path("own code")


def plain(entry: dict[str, Any]) -> dict[str, Any]:
    """Return the settings of a phase as JSON has them.

    InputError where a value is no text, number, list or mapping.
    """

    def of_numpy(value: object) -> object:
        if isinstance(value, np.generic | np.ndarray):
            return value.tolist()
        raise InputError(Problem("a setting of a phase", value=value, allowed="text, number, list or mapping"))

    copied: dict[str, Any] = json.loads(json.dumps(entry, default=of_numpy))
    return copied


def checked_phase(entry: dict[str, Any], held_at: float | None, known: set[str], job: Job) -> None:
    """Raise InputError where a phase is wrong or leaves the bench's limits.

    A phase may do the latter on the bench's model.

    `held_at` is where the plate is held before it, in rad, None with the bridge off; `known` are ids that are taken.
    """
    if entry["id"] in known:
        raise InputError(Problem("this phase id stands twice", value=entry["id"], remedy="give it another one"))
    if "until" in entry:
        raise InputError(Problem("'until' is for scenario files", remedy="check `seen` between short motions"))
    if entry["kind"] == "prompt":
        raise InputError(Problem("a prompt is for scenario files", remedy="ask in your own code"))
    before = (
        []
        if held_at is None
        else [{"kind": "hold", "id": "before", "position": f"{held_at!r} rad", "duration": "0.1 s"}]
    )
    try:
        phases = tuple(read_phase(one) for one in (*before, entry))
    except ValidationError as error:
        raise InputError(*(_of_phase(found, entry) for found in error.errors(include_url=False))) from None
    scenario = Document(
        _SOURCE, Scenario.model_construct(schema_="etb_hil/scenario/1", name="own code", phases=phases), {}
    )
    check_scenario(scenario, job.setup, job.model.values)
    rehearse(scenario, job.setup.bench, job.model, job.limits)


def _of_phase(found: ErrorDetails, entry: dict[str, Any]) -> Problem:
    """Return what is wrong with a setting of a phase, or with its kind."""
    key = [str(part) for part in found["loc"][1:]]
    place = Place(f"phase '{entry['id']}'", key=".".join(key) or "kind")
    kinds = phase_kinds()
    if found["type"] == "union_tag_invalid":
        kind = str(entry["kind"])
        return Problem("no such kind", place, kind, ", ".join(kinds), did_you_mean(kind, kinds))
    if found["type"] == "extra_forbidden" and len(key) == 1:
        names = kinds[entry["kind"]].model_fields
        return Problem("unknown key", place, entry[key[0]], ", ".join(names), did_you_mean(key[0], names, "remove it"))
    return problem_of(found, place)


def end_of(entry: dict[str, Any], job: Job) -> float | None:
    """Return where a phase leaves the set-point, in rad.

    None where it leaves the bridge off.
    """
    throttle = job.model.values
    trajectory = read_phase(entry).trajectory(throttle.limp_home, throttle)
    last = trajectory.at(trajectory.duration)
    return float(last.position) if last.enable else None


def judged_so_far(folder: Path, job: Job, limits: Path | None) -> Run:
    """Judge the frames that a run has left on the disk, as if it ended there."""
    from etb_hil.api.runs import Run
    from etb_hil.replays.log_frames import Frames
    from etb_hil.replays.log_replay import LogJob, judge
    from etb_hil.replays.session_replay import RuleFiles
    from etb_hil.session.record import read_record
    from etb_hil.session.session import open_session

    session = open_session(folder)
    files = RuleFiles(job.files.bench, job.files.model, limits or job.files.limits, job.setup.dbc, job.observer)
    phases = tuple(read_record(session.events).phases)
    log = LogJob((session.raw_log,), files, files.read(), phases)
    finished = judge(log, Frames([session.raw_log]))
    return Run(replace(finished, session=session))
