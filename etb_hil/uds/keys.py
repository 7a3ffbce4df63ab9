"""Key functions of security access.

Ours is for the virtual controller; plug-ins add those of others.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from functools import cache

from etb_hil.base.plugins import Part, parts, when_changed

DEFAULT_KEY = "example"


@dataclass(frozen=True, slots=True)
class SecurityKey:
    """A function that makes the key of a seed and a security level.

    Seed and key are bytes, the level is an odd number.
    """

    compute: Callable[[bytes, int], bytes]


def _example(seed: bytes, level: int) -> bytes:
    """Return each byte of the seed turned over, plus the level.

    The result is a key for trying things out, and no secret.
    """
    return bytes((byte ^ 0xFF) + level & 0xFF for byte in seed)


@cache
def _keys() -> dict[str, SecurityKey]:
    found = {DEFAULT_KEY: SecurityKey(_example)}
    for part in parts("keys"):
        check_key_part(part)
        name = part.name.replace("_", "-")  # as a file of Python cannot be named
        if name in found:
            raise part.refused(f"there is a key function {name} already")
        found[name] = _guarded(part)
    return found


def check_key_part(part: Part) -> None:
    """Raise InputError where the declaration of a key function breaks the contract."""
    part.require(SecurityKey)
    part.require_function("compute", part.value.compute, "seed", "level")


def key_names() -> tuple[str, ...]:
    """Return the names of all key functions, ours first.

    Raises InputError where a plug-in breaks the contract.
    """
    return tuple(_keys())


def key_of(name: str, seed: bytes, level: int) -> bytes:
    """Return the key that a function makes of a seed.

    KeyError where there is no such function; InputError where that of a plug-in fails.
    """
    return _keys()[name].compute(seed, level)


def _guarded(part: Part) -> SecurityKey:
    def compute(seed: bytes, level: int) -> bytes:
        with part.guarded("computing a key"):
            key = part.value.compute(seed, level)
            if not isinstance(key, bytes | bytearray) or not key:
                raise TypeError(f"it returned {key!r} in place of bytes")
            return bytes(key)

    return SecurityKey(compute)


when_changed(_keys.cache_clear)
when_changed(_keys)
