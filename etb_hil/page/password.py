"""The password of a page that others on the network see.

A file holds its hash, never the password itself.
"""

from __future__ import annotations

import hashlib
import hmac
import os
import re
import stat
from pathlib import Path

from etb_hil.base.errors import InputError, Place, Problem
from etb_hil.base.files import write_text

FEWEST = 10  # letters
_N, _R, _P = 1 << 15, 8, 1  # OWASP password storage cheat sheet, scrypt: 32 MiB a try
_MEMORY = 64 << 20
_LINE = re.compile(r"scrypt \$([0-9a-f]{32})\$([0-9a-f]{64})\n?")


def set_password(path: Path, password: str) -> None:
    """Write the hash of a password into a file that its owner alone can read.

    InputError where the password is too short.
    """
    if password != password.encode(errors="replace").decode():
        raise InputError(Problem("the password must be text in UTF-8", remedy="type another one"))
    if len(password) < FEWEST:
        raise InputError(Problem("the password is too short", value=len(password), allowed=f"{FEWEST} letters or more"))
    salt = os.urandom(16)
    before = os.umask(0o077)
    try:
        write_text(path, f"scrypt ${salt.hex()}${_hash(password, salt).hex()}\n")
    finally:
        os.umask(before)


class Password:
    """The password of which a file holds the hash.

    InputError where the file is none, or others can read it.
    """

    def __init__(self, path: Path) -> None:
        make = f"make it with: etb-hil page --set-password {path}"
        try:
            mode, text = path.stat().st_mode, path.read_text("utf-8")
        except (OSError, UnicodeDecodeError) as error:
            raise InputError(Problem(f"must be a password file: {error}", Place(path), remedy=make)) from None
        if stat.S_IMODE(mode) & 0o077:
            raise InputError(Problem("others can read the password file", Place(path), remedy=f"chmod 600 {path}"))
        found = _LINE.fullmatch(text)
        if found is None:
            raise InputError(Problem("must be a password file", Place(path), remedy=make))
        self._salt, self._hash = bytes.fromhex(found[1]), bytes.fromhex(found[2])

    def fits(self, given: str) -> bool:
        """Return whether this is the password; takes about 0.1 s, whatever is given."""
        return hmac.compare_digest(_hash(given, self._salt), self._hash)


def _hash(password: str, salt: bytes) -> bytes:
    # JSON can carry half a surrogate pair, which no password has: it is hashed as it is, and fits none.
    given = password.encode(errors="surrogatepass")
    return hashlib.scrypt(given, salt=salt, n=_N, r=_R, p=_P, maxmem=_MEMORY, dklen=32)
