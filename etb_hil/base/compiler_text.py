"""Errors of Numba's compiler in the words of a plug-in's author."""

from __future__ import annotations

import re

_SIGNATURE = re.compile(r">>> (\w+)\((.*)\)")
_ATTRIBUTE = re.compile(r"Unknown attribute '(\w+)' of type (.*)")
_BRANCHES = re.compile(r"Cannot unify (.*) and (.*) for '")
_GLOBAL = re.compile(r"Untyped global name '(\w+)'")
_NAME = re.compile(r"NameError: (name '\w+' is not defined)")
_SOURCE_LINE = re.compile(r'File "[^<].*", line (\d+):')
_OPERATORS = {
    "add": "+", "sub": "-", "mul": "*", "truediv": "/", "floordiv": "//", "mod": "%", "pow": "**", "matmul": "@",
    "lt": "<", "le": "<=", "gt": ">", "ge": ">=", "eq": "==", "ne": "!=", "getitem": "[]", "setitem": "[] =",
    "and_": "&", "or_": "|", "neg": "-", "not_": "not",
}  # fmt: skip
_TYPES = (
    (r"u?int\d*|Literal\[int\].*", "a whole number"),
    (r"float\d*|complex\d*", "a number"),
    (r"bool.*|Literal\[bool\].*", "a truth value"),
    (r"unicode_type|Literal\[str\].*|bytes.*", "a text"),
    (r"(?:reflected )?list.*|ListType.*", "a list"),
    (r"(?:Uni)?Tuple.*", "a tuple"),
    (r"(?:Dict|LiteralStrKeyDict).*", "a dictionary"),
    (r"[Aa]rray.*|unaligned array.*", "an array"),
    (r"[Nn]one.*", "None"),
)


def plain_text(error: BaseException) -> str:
    """Return what an error of the compiler says of the source, with its line.

    The text is empty where the error is not one that an author can correct in the source.
    """
    lines = [line.strip() for line in str(error).splitlines() if line.strip()]
    said = next(filter(None, map(_said, lines)), "")
    source = next(filter(None, map(_SOURCE_LINE.fullmatch, lines)), None)
    return f"line {source[1]}: {said}" if said and source is not None else said


def _said(line: str) -> str:
    if (found := _NAME.search(line)) or (found := _GLOBAL.search(line)):
        return found[1] if found.re is _NAME else f"compiled code cannot use {found[1]!r}"
    if found := _ATTRIBUTE.search(line):
        return f"{_kind(found[2])} has no attribute {found[1]!r}"
    if found := _BRANCHES.search(line):
        return f"a value is {_kind(found[1])} in one branch and {_kind(found[2])} in another"
    if found := _SIGNATURE.search(line):
        name = found[1]
        kinds = [_kind(one) for one in _split(found[2])]
        if name == "iadd":  # where the result of a term is added to the others
            return f"the result must be a number (it is {kinds[-1]})"
        return f"`{_OPERATORS.get(name, name)}` cannot be used with {' and '.join(kinds)}"
    return ""


def _kind(name: str) -> str:
    return next((said for pattern, said in _TYPES if re.fullmatch(pattern, name.strip())), f"the type {name.strip()}")


def _split(arguments: str) -> list[str]:
    """Return the types of a signature; commas inside of brackets are part of one."""
    parts, depth = [""], 0
    for letter in arguments:
        depth += (letter in "([{<") - (letter in ")]}>")
        if letter == "," and not depth:
            parts.append("")
        else:
            parts[-1] += letter
    return parts
