"""Whatever is wrong with a value, the words are ours: pydantic's own are for programmers."""

import re
from typing import Annotated, get_args

import pytest
import yaml
from pydantic import Field, ValidationError
from pydantic_core.core_schema import ErrorType

from etb_hil.base.errors import InputError, Place
from etb_hil.base.stock import find
from etb_hil.base.validation import problem_of
from etb_hil.base.yamlfile import FileModel, load, parse
from etb_hil.cli.file_kinds import definition
from etb_hil.results.explanation_file import explanation_from_dict
from etb_hil.results.json_file import result_from_dict

FOREIGN = re.compile(r"Input|should|valid|Extra inputs|Field required|Unable to")
CONTEXT = {"ge": 1, "gt": 1, "le": 1, "lt": 1, "min_length": 1, "max_length": 1, "actual_length": 2, "pattern": "^a$"}
WRONG = (None, 5, -1, 1.5, "abc", "", [], {"a": 1}, [[1]], True)
STOCK = {"scenario": "friction_check", "bench": "virtual_uds_data", "model": "faulty", "limits": "end_of_line"}


@pytest.mark.parametrize("kind", get_args(ErrorType))
def test_each_kind_of_error_has_words_of_ours(kind):
    context = CONTEXT | ({"expected": "'a' or 'b'"} if kind in {"literal_error", "enum"} else {})
    found = {"type": kind, "loc": ("key",), "msg": "Input should be a valid tuple", "input": 7, "ctx": context}
    if kind in {"value_error", "assertion_error"}:
        found["msg"] = "Value error, our words, with a comma"
    words = str(problem_of(found, Place("file.yaml", 3, "key")))
    assert words.startswith("file.yaml:3: key: ")
    assert not FOREIGN.search(words), words


class Everything(FileModel):
    text: Annotated[str, Field(min_length=2, max_length=4)] = "ab"
    count: int = 1
    size: float = 1.0
    yes: bool = True
    several: tuple[str, ...] = ()
    named: Annotated[dict[str, int], Field(default_factory=dict)]


@pytest.mark.parametrize(
    ("key", "value", "words"),
    [
        ("text", 5, "text: must be a text (it is 5)"),
        ("text", "a", "text: has 1 letters; allowed: at least 2"),
        ("text", None, "text: is empty; allowed: a text"),
        ("count", 1.5, "count: must be a whole number (it is 1.5)"),
        ("count", "many", "count: must be a whole number (it is 'many')"),
        ("size", "1 cm", "size: must be a number (it is '1 cm')"),
        ("yes", "maybe", "yes: must be true or false (it is 'maybe')"),
        ("several", "a", "several: must be a list, as [first, second] (it is 'a')"),
        ("named", 3, "named: must be keys with values, as 'key: value' (it is 3)"),
    ],
)
def test_a_value_of_another_kind_is_said_to_be_one(key, value, words, tmp_path):
    path = tmp_path / "any.yaml"
    path.write_text(f"{yaml.safe_dump({key: value})}")
    with pytest.raises(InputError) as refused:
        load(path, Everything)
    assert str(refused.value) == f"{path}:1: {words}"


@pytest.mark.parametrize("kind", STOCK)
def test_no_wrong_value_of_a_file_is_answered_in_foreign_words(kind):
    data, _ = parse(find(kind, STOCK[kind]))
    said = set()
    for where in places(data):
        for wrong in WRONG:
            try:
                definition(kind).model_validate(put(data, where, wrong))
            except ValidationError as error:
                said |= {str(problem_of(one, Place())) for one in error.errors()}
    assert len(said) > 20
    assert [words for words in said if FOREIGN.search(words)] == []


@pytest.mark.parametrize("read", [result_from_dict, explanation_from_dict])
@pytest.mark.parametrize("data", [{}, {"unit": 5, "verdict": 7}, {"bench": {"outcome": "none"}, "causes": [1]}])
def test_a_damaged_file_of_results_is_refused_in_our_words(read, data):
    with pytest.raises(InputError) as refused:
        read(data)
    assert not FOREIGN.search(str(refused.value)), refused.value


def places(node, above=()):
    """Yield the path of each value; of a long list, those of its first entries."""
    yield above
    pairs = node.items() if isinstance(node, dict) else enumerate(node[:2]) if isinstance(node, list) else ()
    for key, value in pairs:
        yield from places(value, (*above, key))


def put(node, where, value):
    """Return a copy of nested data with another value in one place."""
    if not where:
        return value
    copied = list(node) if isinstance(node, list) else dict(node)
    copied[where[0]] = put(node[where[0]], where[1:], value)
    return copied
