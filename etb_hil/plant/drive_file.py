"""Read the model file of whatever was measured, a throttle or a drive."""

from __future__ import annotations

from pathlib import Path

from etb_hil.base.errors import InputError, Place, Problem
from etb_hil.base.yamlfile import load, parse
from etb_hil.plant.drive_model import drive_model
from etb_hil.plant.drive_parts import DRIVE_SCHEMA, DriveFile
from etb_hil.plant.flat_drive_file import FLAT_SCHEMA, FlatDriveFile, flat_key, in_parts
from etb_hil.plant.parameters import Model, load_model


def load_plant(path: Path) -> Model:
    """Read a throttle's or a drive's model file.

    Raises InputError that lists the problems with file, line and key.
    """
    data, lines = parse(path)
    schema = str(data.get("schema")) if isinstance(data, dict) else ""
    if schema == FLAT_SCHEMA:
        flat = load(path, FlatDriveFile)
        return drive_model(in_parts(flat.content), lambda *key: flat.place(*flat_key(key)))
    if schema == DRIVE_SCHEMA:
        document = load(path, DriveFile)
        return drive_model(document.content, document.place)
    if schema.startswith("etb_hil/drive/"):
        place = Place(path, lines[("schema",)], "schema")
        raise InputError(Problem("unknown schema of a drive", place, schema, f"{DRIVE_SCHEMA}, {FLAT_SCHEMA}"))
    return load_model(path)
