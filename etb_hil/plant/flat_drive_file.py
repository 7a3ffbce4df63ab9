"""The first schema of a drive's model file: driven in force, without parts."""

from __future__ import annotations

from typing import Annotated, Literal

from pydantic import Field

from etb_hil.base.yamlfile import FileModel
from etb_hil.plant.drive_parts import DRIVE_SCHEMA, DriveEntry, DriveFile
from etb_hil.plant.model_file import EffectEntry, Text

FLAT_SCHEMA = "etb_hil/drive/1"
# Where the keys of the parts stand in a file without parts.
_FLAT = {
    ("driven_by", "force", "noise"): "drive_noise",
    ("driven_by", "torque", "noise"): "drive_noise",
    ("friction", "viscous"): "viscous",
    ("friction", "coulomb"): "coulomb",
    ("friction", "stiction"): "stiction",
    ("friction", "presliding"): "presliding",
    ("friction", "settled_speed"): "settled_speed",
    ("load", "constant"): "constant_load",
}


class FlatDriveFile(FileModel):
    """A drive's model file of the first schema."""

    schema_: Annotated[Literal["etb_hil/drive/1"], Field(alias="schema")]
    name: Text
    description: Text
    motion: Literal["linear", "rotary"]
    inertia: DriveEntry
    viscous: DriveEntry
    coulomb: DriveEntry
    stiction: DriveEntry | None = None
    constant_load: DriveEntry
    presliding: str
    settled_speed: str
    travel_per_turn: str
    position_step: str
    drive_noise: str
    effects: list[EffectEntry] = Field(default_factory=list)


def in_parts(content: FlatDriveFile) -> DriveFile:
    """Return what a file says as one that is made of parts."""
    its = content.model_dump(exclude={"schema_"})
    driven = "force" if content.motion == "linear" else "torque"
    found: dict[str, object] = {"schema": DRIVE_SCHEMA, "driven_by": {driven: {"noise": its.pop("drive_noise")}}}
    for (part, *key), flat in _FLAT.items():
        if len(key) == 1:
            found.setdefault(part, {})[key[0]] = its.pop(flat)  # type: ignore[index]
    return DriveFile.model_validate({**found, **its})


def flat_key(key: tuple[str | int, ...]) -> tuple[str | int, ...]:
    """Return the key, in a file without parts, of one in a file that has them."""
    found = next((part for part in _FLAT if key[: len(part)] == part), None)
    return key if found is None else (_FLAT[found], *key[len(found) :])
