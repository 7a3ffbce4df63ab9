"""YAML files that people write, checked by a pydantic model.

They are read as YAML 1.2 with positions kept.

PyYAML reads YAML 1.1, where `off` is False, `0123` is 83 and `1:30` is 90. Only its parser is used here; scalars are
resolved by the core schema of YAML 1.2. Anchors, aliases and tags are refused: nothing that people write here needs
them, and they are how a small file becomes a huge one.
"""

from __future__ import annotations

import functools
import re
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any, Generic, TypeVar

import yaml
from pydantic import BaseModel, ConfigDict, ValidationError

from etb_hil.base.errors import InputError, Place, Problem
from etb_hil.base.nearest import did_you_mean
from etb_hil.base.userfile import read_bytes
from etb_hil.base.validation import problem_of, shown

if TYPE_CHECKING:
    from pydantic_core import ErrorDetails

_LOADER = getattr(yaml, "CSafeLoader", yaml.SafeLoader)  # libyaml's parser is ten times as fast where PyYAML has it
MAX_BYTES = 1 << 20
_FILL = "write at least its schema and name; 'etb-hil schema KIND' lists the keys of each kind of file"
MAX_DEPTH = 32
MAX_DIGITS = 20  # longer than any integer that a file needs; what is longer stays text, and is refused as such

_CONTROL = re.compile(r"[\x00-\x08\x0b-\x1f\x7f-\x9f]")  # what a terminal would obey
_INT = re.compile(r"[-+]?(0|[1-9][0-9]*)\Z")
_HEX = re.compile(r"0x[0-9a-fA-F]+\Z")
_OCTAL = re.compile(r"0o[0-7]+\Z")
_FLOAT = re.compile(r"[-+]?(\.[0-9]+|(0|[1-9][0-9]*)(\.[0-9]*)?)([eE][-+]?[0-9]+)?\Z")
_WORDS: dict[str, object] = {
    "": None, "~": None, "null": None, "Null": None, "NULL": None,
    "true": True, "True": True, "TRUE": True, "false": False, "False": False, "FALSE": False,
}  # fmt: skip

Path_ = tuple[str | int, ...]
Schema = dict[str, Any]
ModelT = TypeVar("ModelT", bound=BaseModel)


class FileModel(BaseModel):
    """Base of every model of a file.

    Unknown keys are refused, values cannot change after reading.
    """

    model_config = ConfigDict(extra="forbid", frozen=True, allow_inf_nan=False, defer_build=True)


@dataclass(frozen=True, slots=True)
class Document(Generic[ModelT]):
    """A file that was read and checked, and where each of its keys stands."""

    path: Path
    content: ModelT
    lines: dict[Path_, int]

    def place(self, *key: str | int) -> Place:
        """Return file, line and key of a value.

        Where the file does not have the key, they are those of the nearest key above it.
        """
        return _place(self.path, self.lines, key)


def load(path: Path, model: type[ModelT]) -> Document[ModelT]:
    """Read a YAML file into a pydantic model.

    InputError lists every problem with file, line, key and value.
    """
    data, lines = parse(path)
    try:
        content = model.model_validate(data)
    except ValidationError as error:
        raise InputError(*_problems(path, lines, model, error)) from None
    return Document(path, content, lines)


def parse(path: Path) -> tuple[object, dict[Path_, int]]:
    """Read a YAML file; return plain data and the line of each key path."""
    raw = read_bytes(path, MAX_BYTES)
    try:
        text = raw.decode("utf-8-sig")
    except UnicodeDecodeError as error:
        line = raw[: error.start].count(b"\n") + 1
        raise InputError(Problem("is not UTF-8 text", Place(path, line), remedy="save it as UTF-8")) from None
    return _Reader(path).read(text)


class _Reader:
    """Builds plain data from the parser's events."""

    _events: Any  # PyYAML's stubs give every event the attributes of the barest one

    def __init__(self, path: Path) -> None:
        self._path = path
        self.lines: dict[Path_, int] = {}

    def read(self, text: str) -> tuple[object, dict[Path_, int]]:
        try:
            self._events = yaml.parse(text, Loader=_LOADER)
            self._expect(yaml.StreamStartEvent)
            event = next(self._events)
            if isinstance(event, yaml.StreamEndEvent):
                raise InputError(Problem("is empty", Place(self._path), remedy=_FILL))
            data = self._node(next(self._events), (), 0)
            self._expect(yaml.DocumentEndEvent)
            event = next(self._events)
            if not isinstance(event, yaml.StreamEndEvent):
                self._refuse(event, (), "holds more than one document", "keep one document a file")
        except yaml.MarkedYAMLError as error:
            mark = error.problem_mark or error.context_mark
            line = None if mark is None else mark.line + 1
            raise InputError(
                Problem(f"is not YAML: {error.problem or error}", Place(self._path, line), remedy="correct the line")
            ) from None
        except yaml.YAMLError as error:
            raise InputError(Problem(f"is not YAML: {error}", Place(self._path), remedy="correct the file")) from None
        return data, self.lines

    def _expect(self, kind: type) -> None:
        event = next(self._events)
        if not isinstance(event, kind):
            self._refuse(event, (), "is not a plain YAML document", "keep one plain document a file")

    def _refuse(self, event: yaml.Event, key: Path_, what: str, remedy: str) -> None:
        raise InputError(Problem(what, Place(self._path, _line(event), _key_text(key)), remedy=remedy))

    def _node(self, event: yaml.Event, key: Path_, depth: int) -> object:
        self.lines[key] = _line(event)
        if isinstance(event, yaml.AliasEvent) or getattr(event, "anchor", None) is not None:
            self._refuse(event, key, "anchors and aliases are not read", "write the value out")
        if (tag := getattr(event, "tag", None)) is not None:
            self._refuse(event, key, f"the tag {tag} is not read", "remove the tag")
        if depth > MAX_DEPTH:
            self._refuse(event, key, f"is nested deeper than {MAX_DEPTH} levels", "flatten it")
        if isinstance(event, yaml.ScalarEvent):
            if _CONTROL.search(event.value):
                self._refuse(event, key, "holds control characters", "write plain text")
            return _scalar(event.value) if event.implicit[0] else event.value
        if isinstance(event, yaml.SequenceStartEvent):
            return self._sequence(key, depth)
        return self._mapping(key, depth)

    def _sequence(self, key: Path_, depth: int) -> list[object]:
        items: list[object] = []
        while not isinstance(event := next(self._events), yaml.SequenceEndEvent):
            items.append(self._node(event, (*key, len(items)), depth + 1))
        return items

    def _mapping(self, key: Path_, depth: int) -> dict[str, object]:
        entries: dict[str, object] = {}
        while not isinstance(event := next(self._events), yaml.MappingEndEvent):
            if not isinstance(event, yaml.ScalarEvent):
                self._refuse(event, key, "a key is not a word", "use plain words as keys")
            name = event.value
            if name in entries:
                self._refuse(event, (*key, name), "stands twice", "keep one of them")
            entries[name] = self._node(next(self._events), (*key, name), depth + 1)
            self.lines[(*key, name)] = _line(event)
        return entries


def _line(event: yaml.Event) -> int:
    return 1 if event.start_mark is None else event.start_mark.line + 1


def _scalar(text: str) -> object:
    if text in _WORDS:
        return _WORDS[text]
    if _INT.match(text):
        return int(text) if len(text) <= MAX_DIGITS else float(text)
    if _HEX.match(text) and len(text) <= MAX_DIGITS:
        return int(text, 16)
    if _OCTAL.match(text) and len(text) <= MAX_DIGITS:
        return int(text, 0)
    if _FLOAT.match(text):
        return float(text)
    return text


def _key_text(key: Path_) -> str | None:
    text = ""
    for part in key:
        text += f"[{part}]" if isinstance(part, int) else f".{part}" if text else part
    return text or None


def _place(path: Path, lines: dict[Path_, int], key: Path_) -> Place:
    for end in range(len(key), -1, -1):
        if key[:end] in lines:
            return Place(path, lines[key[:end]], _key_text(key))
    return Place(path, None, _key_text(key))


def _problems(path: Path, lines: dict[Path_, int], model: type[BaseModel], error: ValidationError) -> list[Problem]:
    found = []
    details = error.errors(include_url=False)
    schema = functools.cache(model.model_json_schema)  # once a file: it takes a tenth of a second for a scenario
    for detail in details:
        if _follows_from_others(detail["loc"], details):
            continue
        key = _file_key(tuple(detail["loc"]), lines)
        if detail["type"] == "union_tag_invalid":
            key = (*key, str(detail["ctx"]["discriminator"]).strip("'"))
        place = _place(path, lines, key)
        found.append(_key_problem(detail, schema, key, place) or problem_of(detail, place))
    return found


def _key_problem(detail: ErrorDetails, schema: Callable[[], Schema], key: Path_, place: Place) -> Problem | None:
    """Return what is wrong with a key; None where it is the value."""
    value = shown(detail)
    if detail["type"] == "extra_forbidden":
        names = _allowed_names(schema(), detail["loc"])
        remedy = did_you_mean(str(key[-1]), names, "remove it")
        return Problem("unknown key", place, value=value, allowed=", ".join(names) or None, remedy=remedy)
    if detail["type"] == "missing":
        return Problem("this key is missing", place, remedy=f"add '{key[-1]}'" if key else None)
    if detail["type"] == "union_tag_not_found":
        field = str(detail["ctx"]["discriminator"]).strip("'")
        names = _tags(schema(), detail["loc"], field)
        return Problem(f"the key '{field}' is missing", place, allowed=", ".join(names), remedy=f"add '{field}'")
    if detail["type"] == "union_tag_invalid":
        tag, names = str(detail["ctx"]["tag"]), detail["ctx"]["expected_tags"].replace("'", "").split(", ")
        return Problem(f"no such {key[-1]}", place, tag, ", ".join(names), did_you_mean(tag, names))
    return None


def _follows_from_others(location: tuple[str | int, ...], details: Sequence[ErrorDetails]) -> bool:
    """Return whether an error stands for those inside.

    Entries that are wrong count as none.
    """
    own = next(detail for detail in details if detail["loc"] == location)
    inside = (d["loc"] for d in details if len(d["loc"]) > len(location) and d["loc"][: len(location)] == location)
    return own["type"] == "too_short" and next(inside, None) is not None


def _tags(schema: Schema, location: tuple[str | int, ...], field: str) -> list[str]:
    """Return what the key that tells the kinds of a union apart may say."""
    definitions = schema.get("$defs", {})
    nodes = [schema]
    for part in location:
        nodes = [child for node in nodes for child in _children(node, part, definitions)]
    shapes = [shape for node in nodes for shape in _shapes(node, definitions)]
    tags = [shape.get("properties", {}).get(field, {}).get("const") for shape in shapes]
    return [tag for tag in tags if tag is not None]


def _file_key(location: tuple[str | int, ...], lines: dict[Path_, int]) -> Path_:
    """Drop the parts of pydantic's location that stand nowhere in the file.

    They are names of union members, and '[key]'.
    """
    key: Path_ = ()
    location = tuple(part for part in location if part != "[key]")
    for index, part in enumerate(location):
        if (*key, part) in lines or index == len(location) - 1:
            key = (*key, part)
    return key


def _allowed_names(schema: Schema, location: tuple[str | int, ...]) -> list[str]:
    definitions = schema.get("$defs", {})
    nodes = [schema]
    for part in location[:-1]:
        nodes = [child for node in nodes for child in _children(node, part, definitions)]
    shapes = [shape for node in nodes for shape in _shapes(node, definitions)]
    return sorted({name for shape in shapes for name in shape.get("properties", {})})


def _shapes(node: dict[str, Any], definitions: dict[str, dict[str, Any]]) -> list[dict[str, Any]]:
    """Return a node of a schema, and the members of the union that it may be."""
    node = _resolve(node, definitions)
    return [node, *(_resolve(v, definitions) for key in ("anyOf", "oneOf") for v in node.get(key, []))]


def _resolve(node: dict[str, Any], definitions: dict[str, dict[str, Any]]) -> dict[str, Any]:
    reference = node.get("$ref")
    return definitions[str(reference).rsplit("/", 1)[-1]] if reference else node


def _children(node: dict[str, Any], part: str | int, definitions: dict[str, dict[str, Any]]) -> list[dict[str, Any]]:
    node, *variants = _shapes(node, definitions)
    if named := [v for v in variants if v.get("properties", {}).get("kind", {}).get("const") == part]:
        return named  # the name of a union's member, which may be the name of another one's key as well
    found = []
    for candidate in [node, *variants]:
        if isinstance(part, int):
            child = candidate.get("items")
        else:
            properties = candidate.get("properties", {})
            child = properties.get(part) or candidate.get("additionalProperties")
        if isinstance(child, dict):
            found.append(child)
    return found or (variants if isinstance(part, str) else [])  # a union's member that pydantic names by its type
