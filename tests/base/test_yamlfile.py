"""Files that people write: YAML 1.2 values, positions, and refusals that say where and what to do."""

from pathlib import Path
from typing import Annotated, Literal

import pytest
from hypothesis import given
from hypothesis import strategies as st
from pydantic import Field

from etb_hil.base.errors import InputError
from etb_hil.base.quantity import Angle, Duration
from etb_hil.base.yamlfile import FileModel, load, parse


class Turn(FileModel):
    kind: Literal["turn"]
    angle: Angle


class Wait(FileModel):
    kind: Literal["wait"]
    duration: Duration
    turn: Duration = 1.0  # as another kind is called


class Plan(FileModel):
    name: str
    steps: Annotated[tuple[Annotated[Turn | Wait, Field(discriminator="kind")], ...] | None, Field(min_length=1)] = None
    tries: Annotated[int, Field(le=3)] = 1
    label: Annotated[str, Field(pattern="^[a-z]+$")] = "a"


def written(tmp_path: Path, text: str) -> Path:
    path = tmp_path / "plan.yaml"
    path.write_text(text, "utf-8")
    return path


@pytest.mark.parametrize(
    ("text", "value"),
    [
        ("off", "off"), ("no", "no"), ("0123", "0123"), ("1:30", "1:30"), ("1e4", 1e4), ("0x1F", 31), ("0o17", 15),
        ("true", True), ("~", None), ("-3", -3), (".5", 0.5), ("'1'", "1"), ("2024-01-01", "2024-01-01"),
        ("1_000", "1_000"),
    ],
)  # fmt: skip
def test_scalars_are_read_as_yaml_1_2(tmp_path, text, value):
    data, _ = parse(written(tmp_path, f"key: {text}\n"))
    assert data == {"key": value}


def test_a_document_knows_where_its_keys_stand(tmp_path):
    document = load(written(tmp_path, "name: x\nsteps:\n  - kind: turn\n    angle: 30 deg\n"), Plan)
    assert document.content.steps[0].angle == pytest.approx(0.5235987755982988)
    assert str(document.place("steps", 0, "angle")).endswith("plan.yaml:4: steps[0].angle")
    assert str(document.place("steps", 0, "absent")).endswith("plan.yaml:3: steps[0].absent")


@pytest.mark.parametrize(
    ("text", "expected"),
    [
        ("name: x\nnmae: y\n", ":2: nmae: unknown key (it is 'y'); allowed: label, name, steps"),
        ("name: x\nnmae: y\n", "; did you mean 'name'?"),
        ("name: x\nsteps:\n  - kind: turn\n    angel: 3 deg\n    angle: 3 deg\n", "plan.yaml:4: steps[0].angel"),
        ("name: x\nsteps:\n  - kind: turn\n    angle: 3 V\n", "must be a unit of angle (got 'V')"),
        ("name: x\nsteps:\n  - kind: turn\n    angle: 3\n", "the unit is missing"),
        ("name: x\nsteps:\n  - kind: turn\n    angle: .nan\n", "plan.yaml:4"),
        ("name: x\nsteps: []\n", "plan.yaml:2: steps: has 0 entries; allowed: at least 1"),
        ("name: x\nsteps:\n  - angle: 3 deg\n", "steps[0]: the key 'kind' is missing; allowed: turn, wait; add 'kind'"),
        ("name: x\ntries: 9\n", "plan.yaml:2: tries: out of range (it is 9); allowed: up to 3"),
        ("name: x\nlabel: A\n", "it is 'A'); allowed: what fits the pattern ^[a-z]+$"),
        ("steps: [{kind: wait, duration: 1 s}]\n", "name: this key is missing"),
        ("name: x\nname: y\n", "plan.yaml:2: name: stands twice"),
        ("plan\n", "plan.yaml:1: holds no keys (it is 'plan'); write 'key: value'"),
        ("name: x\nsteps: [3]\n", "plan.yaml:2: steps[0]"),
        ("name: x\nsteps: [{kind: trun}]\n", "steps[0].kind: no such kind (it is 'trun'); allowed: turn, wait; did"),
        ("name: &a x\n", "anchors and aliases are not read"),
        ("name: !!python/object:os.system x\n", "is not read; remove the tag"),
        ("name: [1, 2\n", "is not YAML"),
        ("", "is empty"),
        ("---\nname: x\n---\nname: y\n", "more than one document"),
        ("[" * 100 + "]" * 100, "nested deeper"),
    ],
)  # fmt: skip
def test_refusals_name_file_line_key_and_remedy(tmp_path, text, expected):
    with pytest.raises(InputError) as caught:
        load(written(tmp_path, text), Plan)
    assert expected in str(caught.value)
    assert "plan.yaml" in str(caught.value)


def test_a_wrong_key_inside_a_variant_lists_that_variants_keys(tmp_path):
    with pytest.raises(InputError, match=r"allowed: angle, kind; did you mean 'angle'"):
        load(written(tmp_path, "name: x\nsteps:\n  - kind: turn\n    angel: 3 deg\n    angle: 3 deg\n"), Plan)


def test_a_list_is_not_called_empty_where_its_entries_are_wrong(tmp_path):
    with pytest.raises(InputError) as caught:
        load(written(tmp_path, "name: x\nsteps:\n  - kind: turn\n    angle: 3 V\n"), Plan)
    assert len(caught.value.problems) == 1


def test_bytes_that_are_no_text_and_files_that_are_too_large_are_refused(tmp_path):
    path = tmp_path / "plan.yaml"
    path.write_bytes(b"name: \xff\xfe\n")
    with pytest.raises(InputError, match="not UTF-8"):
        load(path, Plan)
    path.write_bytes(b"#" * (1 << 21))
    with pytest.raises(InputError, match="too large"):
        load(path, Plan)
    with pytest.raises(InputError, match="cannot be read"):
        load(tmp_path / "absent.yaml", Plan)


@given(st.binary(max_size=200))
def test_any_bytes_are_read_or_refused(tmp_path_factory, raw):
    path = tmp_path_factory.mktemp("any") / "plan.yaml"
    path.write_bytes(raw)
    try:
        document = load(path, Plan)
    except InputError as error:
        assert str(path) in str(error)  # noqa: PT017 (either outcome is right, each has its own check)
    else:
        assert isinstance(document.content, Plan)
