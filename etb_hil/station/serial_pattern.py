"""Regular expressions for serial numbers that answer at once, whatever is scanned."""

from __future__ import annotations

import re

LONGEST = 100  # characters of a serial number that a pattern is asked about
_MOST_WAYS = LONGEST**3  # in which a pattern may try to match: under a second
_TOKEN = re.compile(
    r"(?P<item>\\.|\[\^?\]?(?:\\.|[^\]\\])*\])"  # what is escaped or in a class means nothing here
    r"|(?P<strange>\(\?(?![:=!]|i\)))"
    r"|(?P<after_group>\)(?:[*+]|\{[0-9,]))"
    r"|(?P<quantifier>[*+?]|\{(?P<low>[0-9]*)(?P<comma>,?)(?P<high>[0-9]*)\})[?+]?"
    r"|(?P<group>\((?:\?(?:[:=!]|i\)))?)"
    r"|(?P<other>.)",
    re.DOTALL,
)


def check_serial_pattern(text: str) -> None:
    """Raise ValueError where a text is no regular expression that ends in time.

    Some expressions can take for ever to say no.

    Matching tries one way after the other. Without repeated groups there are at most as many as the product of what
    each quantifier and each alternative leaves open, and that is bounded here.
    """
    try:
        re.compile(text)
    except re.error as error:
        raise ValueError(f"no regular expression: {error}") from None
    ways = 1
    for token in _TOKEN.finditer(text):
        if token["after_group"]:
            raise ValueError(
                f"a group is repeated at character {token.start() + 2}, which can take for ever to match; "
                "write it out, or repeat a character or a class alone, as in '[A-Z]+[0-9]{4}'; '?' may follow a group"
            )
        if token["strange"]:
            raise ValueError(
                f"'{text[token.start() : token.start() + 3]}' is not taken in serial numbers; "
                "of the groups with '(?', write only '(?:', '(?=', '(?!' and '(?i)'"
            )
        ways *= 2 if token["other"] == "|" else _open_ways(token)
    if ways > _MOST_WAYS:
        raise ValueError(
            "too many ways to match it, it can take for ever; write fixed counts, as in '[0-9]{4}', "
            "and at most three of '*' and '+'"
        )


def _open_ways(token: re.Match[str]) -> int:
    quantifier = token["quantifier"]
    if not quantifier or quantifier == "{}":
        return 1
    if quantifier == "?":
        return 2
    if quantifier in {"*", "+"} or (token["comma"] and not token["high"]):
        return LONGEST
    return min(int(token["high"] or 0) - int(token["low"] or 0) + 1, LONGEST) if token["comma"] else 1
