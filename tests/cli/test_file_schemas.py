"""The JSON schemas agree with what is read: every file that comes with the project is valid, broken ones are not."""

import json
import re
from pathlib import Path

import jsonschema
import pytest

import etb_hil
from etb_hil.base.stock import find, stock_names
from etb_hil.base.yamlfile import parse
from etb_hil.cli.file_kinds import KINDS, file_schema
from etb_hil.cli.main import main

EXAMPLES = Path(__file__).parents[2] / "docs" / "examples"
STOCK = [(kind, find(kind, name)) for kind in ("scenario", "bench", "model", "limits") for name in stock_names(kind)]
STOCK += [("table_map", path) for path in sorted(EXAMPLES.glob("*.map.yaml"))]
STOCK += [("station", path) for path in sorted(EXAMPLES.glob("*.station.yaml"))]
STOCK += [("drive", path) for path in sorted(EXAMPLES.glob("*.drive.yaml"))]
STOCK += [("bench", path) for path in sorted(EXAMPLES.glob("*.bench.yaml"))]
STOCK += [(kind, EXAMPLES / "ci" / f"{kind}.yaml") for kind in ("limits", "baseline")]


WRITTEN_BY_THE_BENCH = {"waiting_run", "session", "events", "history", "explanation"}  # and by nobody else


def test_every_kind_of_file_that_the_package_reads_has_a_schema():
    sources = (path.read_text("utf-8") for path in Path(etb_hil.__file__).parent.rglob("*.py"))
    named = {kind for source in sources for kind in re.findall(r"\betb_hil/(\w+)/\d+\b", source)}
    assert named - WRITTEN_BY_THE_BENCH == set(KINDS)
    for kind in KINDS:
        assert re.fullmatch(rf"etb_hil/{kind}/\d+", file_schema(kind)["properties"]["schema"]["const"])


@pytest.mark.parametrize(("kind", "path"), STOCK, ids=[f"{kind}-{path.stem}" for kind, path in STOCK])
def test_stock_files_are_valid(kind, path):
    data, _ = parse(path)
    schema = file_schema(kind)
    jsonschema.Draft202012Validator.check_schema(schema)
    jsonschema.validate(data, schema, jsonschema.Draft202012Validator)


@pytest.mark.parametrize("kind", KINDS)
@pytest.mark.parametrize(
    "change", [lambda d: d | {"unheard_of": 1}, lambda d: {**d, "schema": "other"}, lambda d: {"schema": d["schema"]}]
)
def test_broken_files_are_not(kind, change):
    path = next(path for known, path in STOCK if known == kind)
    data, _ = parse(path)
    with pytest.raises(jsonschema.ValidationError):
        jsonschema.validate(change(data), file_schema(kind), jsonschema.Draft202012Validator)


def test_the_command_lists_prints_and_writes(tmp_path, capsys):
    assert main(["schema"]) == 0
    listed = capsys.readouterr().out.split()
    assert listed == [*KINDS, "results", "explanation"]
    assert main(["schema", "scenario"]) == 0
    assert json.loads(capsys.readouterr().out) == file_schema("scenario")
    assert main(["schema", "--out", str(tmp_path / "new")]) == 0
    assert sorted(p.name for p in (tmp_path / "new").iterdir()) == sorted(f"{kind}.schema.json" for kind in listed)
    assert main(["schema", "nonsense"]) == 2
    assert "allowed: scenario" in capsys.readouterr().err
    with pytest.raises(SystemExit):
        main(["schema", "--help"])
    assert not set(listed) - set(re.findall(r"\w+", capsys.readouterr().out))


def test_a_mistyped_kind_is_answered_with_the_nearest(capsys):
    assert main(["schema", "explanatoin"]) == 2
    assert "did you mean 'explanation'?" in capsys.readouterr().err


def test_a_default_has_its_unit_as_in_a_file():
    phase, bus = file_schema("scenario")["$defs"]["DashPhase"], file_schema("bench")["$defs"]["BusSettings"]
    assert phase["properties"]["approach"]["default"] == "1.5 rad/s"
    assert bus["properties"]["data_bitrate"]["default"] == "2000000 bit/s"
    assert bus["properties"]["channel"]["default"] == "bench"
