"""Scenario files: the phases of a run, in order."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated, Literal

from pydantic import Field, model_validator

from etb_hil.base.yamlfile import Document, FileModel, load
from etb_hil.bench.phases import Phase


class Scenario(FileModel):
    """What is done to a unit, phase by phase; every run ends in the safe state, whatever the phases say."""

    schema_: Annotated[Literal["etb_hil/scenario/1"], Field(alias="schema")]
    name: Annotated[str, Field(min_length=1, max_length=80)]
    description: str = ""
    phases: Annotated[tuple[Phase, ...], Field(min_length=1, max_length=200)]

    @model_validator(mode="after")
    def _ids_are_unique(self) -> Scenario:
        ids = [phase.id for phase in self.phases]
        twice = sorted({name for name in ids if ids.count(name) > 1})
        if twice:
            raise ValueError(f"phase ids stand twice: {', '.join(twice)}")
        return self


def load_scenario(path: Path) -> Document[Scenario]:
    """Read a scenario file; InputError lists every problem with file, line, key and value."""
    return load(path, Scenario)
