"""The kinds of file that people write, and the JSON schema of each: made from the definitions that read them."""

from __future__ import annotations

from typing import Any

from etb_hil.base.yamlfile import FileModel
from etb_hil.bench.bench_file import Bench
from etb_hil.diagnosis.limits import Limits
from etb_hil.plant.drive_file import DriveFile
from etb_hil.plant.model_file import ModelFile
from etb_hil.recording.columns import TableMap
from etb_hil.scenario.scenario_file import Scenario
from etb_hil.session.baseline import Baseline
from etb_hil.station.station_file import Station

KINDS: dict[str, type[FileModel]] = {
    "scenario": Scenario,
    "bench": Bench,
    "model": ModelFile,
    "drive": DriveFile,
    "limits": Limits,
    "table_map": TableMap,
    "station": Station,
    "baseline": Baseline,
}
DIALECT = "https://json-schema.org/draft/2020-12/schema"


def file_schema(kind: str) -> dict[str, Any]:
    """Return the JSON schema of a kind of file (a key of `KINDS`), for editors and for other programs."""
    return {"$schema": DIALECT, **KINDS[kind].model_json_schema(by_alias=True)}
