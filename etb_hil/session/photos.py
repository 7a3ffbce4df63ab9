"""Photos that an operator took for a prompt.

They are JPEG files, kept in the session's folder `photos`.
"""

from __future__ import annotations

from collections.abc import Iterable
from pathlib import Path
from typing import TYPE_CHECKING

from etb_hil.base.errors import InputError, Place, Problem
from etb_hil.base.files import make_folder, write_bytes
from etb_hil.base.userfile import read_bytes

if TYPE_CHECKING:
    from etb_hil.session.record import Answered

FOLDER = "photos"
LARGEST = 4_000_000  # bytes: a phone's camera at its finest; the operator page sends a tenth of it
_JPEG = b"\xff\xd8\xff"  # how a JPEG file begins (ISO/IEC 10918-1, markers SOI and the next one)


def photo_name(step_id: str) -> str:
    """Return the path in a session of the photo of a step."""
    return f"{FOLDER}/{step_id}.jpg"


def is_photo(content: bytes) -> bool:
    """Return whether these bytes are a JPEG file of at most `LARGEST` bytes."""
    return len(content) <= LARGEST and content.startswith(_JPEG)


def read_photo(path: Path) -> bytes:
    """Return the content of a photo.

    InputError where it is none, is too large or cannot be read.
    """
    content = read_bytes(path, LARGEST)
    if not is_photo(content):
        raise InputError(Problem("must be a JPEG file", Place(path), allowed=f"a photo as JPEG, up to {LARGEST} bytes"))
    return content


def keep_photos(folder: Path, answers: Iterable[Answered]) -> tuple[str, ...]:
    """Copy the photos of a run's answers into its session.

    Return what could not be kept, a sentence each.
    """
    lost = []
    for said in answers:
        if said.photo:
            try:
                content = read_photo(Path(said.photo))
                make_folder(folder / FOLDER)
                write_bytes(folder / said.entry, content)
            except InputError as error:
                lost.append(f"the photo of step '{said.id}' is not in the session: {error}")
    return tuple(lost)
