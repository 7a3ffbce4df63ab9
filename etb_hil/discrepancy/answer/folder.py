"""Protection of folders: no file of others is overwritten."""

from __future__ import annotations

import json
from collections.abc import Iterable
from pathlib import Path

from etb_hil.base.errors import InputError, Place, Problem
from etb_hil.base.files import must_not_replace
from etb_hil.base.userfile import read_bytes
from etb_hil.results.explanation import SCHEMA

ANSWER_NAME, MODEL_NAME, TEST_NAME = "explanation.json", "model.yaml", "next_test.yaml"
WRITTEN = (ANSWER_NAME, MODEL_NAME, TEST_NAME)

_OF_ANY_VERSION = SCHEMA.rpartition("/")[0]
_ELSEWHERE = "give another folder with --out"


def must_not_lose(folder: Path, inputs: Iterable[Path], names: Iterable[str] = WRITTEN) -> None:
    """Refuse a folder in which an answer would overwrite an input or other files."""
    there = [folder / name for name in names if (folder / name).exists()]
    must_not_replace(((path, _ELSEWHERE) for path in there), inputs)
    if there and not _is_answer(folder / ANSWER_NAME):
        what = f"holds {', '.join(path.name for path in there)}, but no answer that an explanation wrote"
        allowed = f"a folder without them, or one whose {ANSWER_NAME} has the schema {SCHEMA}"
        raise InputError(Problem(what, Place(folder), allowed=allowed, remedy=f"{_ELSEWHERE}, or move them away"))


def _is_answer(path: Path) -> bool:
    try:
        found = json.loads(read_bytes(path))
    except ValueError:  # an InputError, too
        return False
    return isinstance(found, dict) and str(found.get("schema")).startswith(_OF_ANY_VERSION)
