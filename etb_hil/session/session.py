"""A session: the folder with all that a run measured, was told and concluded."""

from __future__ import annotations

import hashlib
import json
import platform
import re
import shutil
from dataclasses import asdict, dataclass
from datetime import UTC, datetime
from functools import cache
from importlib import metadata
from pathlib import Path
from typing import Any

from etb_hil import __version__
from etb_hil.base.errors import InputError, Place, Problem, RecordingFault
from etb_hil.base.files import as_utf8, refused_by_name, write_bytes, write_text
from etb_hil.base.plugins import Plugin, plugins
from etb_hil.base.stated_types import of_stated_types
from etb_hil.base.userfile import read_bytes
from etb_hil.results.json_file import result_as_dict, result_from_dict
from etb_hil.results.run_result import InputFile, RunResult
from etb_hil.session.checksum import Sum, changed, require_sums, require_unchanged, sum_of, write_checked
from etb_hil.session.record import CUT_SHORT

RAW_LOG = "raw.blf"
EVENTS = "events.jsonl"
RESULTS = "results.json"
MANIFEST = "session.json"
SCHEMA = "etb_hil/session/1"
BEFORE_IT_WAS_NAMED = "angle"  # the observer of sessions that do not name theirs


@dataclass(frozen=True, slots=True)
class Session:
    """An opened session folder.

    Scenario, model, observer and seed as far as the session keeps them. A session that `has_sums` is of a version that
    writes checksums of all that a judgement reads.
    """

    folder: Path
    run_id: str
    serial: str
    started: str
    inputs: tuple[InputFile, ...]
    scenario: str = ""
    model: str = ""
    seed: int | None = None
    observer: str = BEFORE_IT_WAS_NAMED
    plugins: tuple[Plugin, ...] = ()
    has_sums: bool = False

    def input_path(self, kind: str) -> Path:
        """Return the session's own copy of an input.

        InputError where it has none of that kind.
        """
        for entry in self.inputs:
            if entry.kind == kind:
                return self.folder / "inputs" / entry.name
        raise InputError(Problem(f"the session has no {kind} file", Place(self.folder / MANIFEST)))

    @property
    def raw_log(self) -> Path:
        """Path of the raw frames."""
        return self.folder / RAW_LOG

    @property
    def events(self) -> Path:
        """Path of the events."""
        return self.folder / EVENTS

    def write_results(self, results: RunResult, *, has_ended: bool = True) -> Path:
        """Write `results.json` whole or not at all, and its checksum.

        Where the run `has_ended`, its events, frames and manifest get checksums, too. RecordingFault where that fails.
        """
        of_run = (self.folder / MANIFEST, self.events, self.raw_log) if has_ended else ()
        covered = [path for path in of_run if path.exists()]
        text = json.dumps(result_as_dict(results), indent=1, ensure_ascii=False) + "\n"
        try:
            return write_checked(
                self.folder / RESULTS, text, covered, "make room, then judge the session again by a replay"
            )
        except InputError as error:
            raise RecordingFault(str(error)) from None

    @property
    def has_results(self) -> bool:
        """Whether the run came so far as to leave results.

        Reading them says whether they are sound.
        """
        return (self.folder / RESULTS).exists()

    def read_results(self) -> RunResult:
        """Return what `results.json` holds.

        InputError where the run left none, or it is damaged or was changed, or its checksum is missing.
        """
        if self.has_sums and self.has_results:
            require_sums(self.folder)
        require_unchanged(self.folder / RESULTS)
        return self.read_results_unchecked()

    def end_is_known(self) -> bool:
        """Return whether it is known how the run ended: a checksum covers the events.

        Of an earlier version, which wrote none, results stand for it. A run without results was cut short, or lost
        power as it wrote them. InputError where events or manifest of a run with results are not those of then.
        """
        if not self.has_sums:
            return self.has_results and not self._says_cut_short()
        if self.has_results:
            require_sums(self.folder)
        sums = {path: sum_of(path) for path in (self.folder / MANIFEST, self.events)}
        wrong = [path for path, found in sums.items() if found is Sum.WRONG]
        if wrong and self.has_results:
            raise changed(wrong[0])
        return all(found is Sum.RIGHT for found in sums.values())

    def _says_cut_short(self) -> bool:
        try:
            return self.read_results_unchecked().bench.reason_id == CUT_SHORT
        except InputError:  # a comparison says what is wrong with them
            return False

    def frames_are_changed(self) -> bool:
        """Return whether the raw frames are not those that the run left."""
        return self.has_sums and sum_of(self.raw_log) is not Sum.RIGHT

    def read_results_unchecked(self) -> RunResult:
        """Return what `results.json` holds now, to be compared with a replay."""
        path = self.folder / RESULTS
        return result_from_dict(_read_json(path), str(path))


@cache
def _installed() -> dict[str, str]:
    names = ("numpy", "numba", "python-can", "cantools")
    return {name: metadata.version(name) for name in names}


def versions() -> dict[str, str]:
    """Return the versions of the program and of what it computes with."""
    return {"etb-hil": __version__, "python": platform.python_version()} | _installed()


def create(
    parent: Path,
    scenario: str,
    serial: str,
    inputs: dict[str, Path],
    *,
    model: str = "",
    seed: int | None = None,
    observer: str = BEFORE_IT_WAS_NAMED,
) -> Session:
    """Make a session folder under `parent`, with copies of the inputs, and return it."""
    now = datetime.now(UTC)
    label = "_".join(part for part in (_slug(scenario), _slug(serial)) if part)
    contents = {kind: read_bytes(path) for kind, path in inputs.items()}
    entries = tuple(
        InputFile(kind, f"{kind}{inputs[kind].suffix}", hashlib.sha256(content).hexdigest())
        for kind, content in contents.items()
    )
    remedy = "give another folder with --out, or make room"
    with refused_by_name(parent, remedy):
        folder = _new_folder(parent, f"{now:%Y%m%d-%H%M%S}_{label}")
    try:
        with refused_by_name(folder, remedy):
            (folder / "inputs").mkdir()
        for entry in entries:
            write_bytes(folder / "inputs" / entry.name, contents[entry.kind], remedy)
        started = now.isoformat(timespec="milliseconds")
        session = Session(
            folder, folder.name, serial, started, entries, scenario, model, seed, observer, plugins(), has_sums=True
        )
        manifest = {
            "schema": SCHEMA,
            "run_id": session.run_id,
            "serial": serial,
            "started": session.started,
            "scenario": scenario,
            "model": model,
            "seed": seed,
            "observer": observer,
            "inputs": [
                {"kind": e.kind, "name": e.name, "sha256": e.sha256, "given_as": as_utf8(inputs[e.kind])}
                for e in entries
            ],
            "has_sums": True,
            "versions": versions(),
            "plugins": [asdict(plugin) | {"file": as_utf8(plugin.file)} for plugin in session.plugins],
        }
        write_text(folder / MANIFEST, json.dumps(manifest, indent=1) + "\n", remedy)
    except InputError:
        shutil.rmtree(folder, ignore_errors=True)  # nothing was measured yet, and half a session is none
        raise
    return session


def open_session(folder: Path) -> Session:
    """Open a session folder; InputError says what is missing."""
    if folder.is_dir() and not (folder / MANIFEST).exists():
        what = f"is a folder without a {MANIFEST}: no session"
        raise InputError(Problem(what, Place(folder), remedy="name a session's folder, or a log"))
    manifest = _read_json(folder / MANIFEST)
    if manifest.get("schema") != SCHEMA:
        raise InputError(
            Problem("is of an unknown schema", Place(folder / MANIFEST, key="schema"), manifest.get("schema"), SCHEMA)
        )
    try:
        entries = tuple(
            of_stated_types(InputFile(e["kind"], _plain_name(folder, e["name"]), e["sha256"]))
            for e in manifest["inputs"]
        )
        kept = ("scenario", "model", "seed", "observer", "has_sums")
        told = {key: manifest[key] for key in kept if key in manifest}
        parts = tuple(_plugin(entry) for entry in manifest.get("plugins", ()))
        made = Session(
            folder,
            manifest["run_id"],
            manifest.get("serial", ""),
            manifest.get("started", ""),
            entries,
            plugins=parts,
            **told,
        )
        return of_stated_types(made)
    except (KeyError, TypeError) as error:
        raise InputError(
            Problem(f"is damaged: {error}", Place(folder / MANIFEST), remedy="restore it from a copy of the session")
        ) from None


def _plugin(entry: dict[str, Any]) -> Plugin:
    return Plugin(str(entry["name"]), str(entry["version"]), str(entry["sha256"]), tuple(map(str, entry["parts"])))


def _plain_name(folder: Path, name: str) -> str:
    if Path(name).name != name or name == ".." or "\0" in name:
        raise InputError(Problem("an input's name leaves the session's folder", Place(folder / MANIFEST), value=name))
    return name


def _new_folder(parent: Path, stem: str) -> Path:
    number = 1
    while True:
        folder = parent / (stem if number == 1 else f"{stem}_{number}")
        try:
            folder.mkdir(parents=True)
        except FileExistsError:
            if not parent.is_dir():
                raise
            number += 1
        else:
            return folder


def _slug(text: str) -> str:
    return re.sub(r"[^A-Za-z0-9]+", "-", text).strip("-").lower()[:40]


def _read_json(path: Path) -> dict[str, Any]:
    raw = read_bytes(path, remedy="give the folder of a session")
    try:
        data = json.loads(raw)
    except (ValueError, RecursionError) as error:
        raise InputError(Problem(f"is not JSON: {error}", Place(path), remedy="restore the file")) from None
    if not isinstance(data, dict):
        raise InputError(Problem("is not a JSON object", Place(path), remedy="restore the file"))
    return data
