"""Python, YAML and SQL of the documents, run or read as printed."""

import sqlite3
import subprocess
import sys

import documents
import duckdb
import jsonschema
import pytest

from etb_hil import plugins, testing
from etb_hil.base.yamlfile import parse
from etb_hil.cli.file_kinds import KINDS, file_schema
from etb_hil.cli.main import main
from etb_hil.diagnosis.measurement_registry import measurement_kinds

HOW_TO = documents.DOCS / "howto"


def run_together(blocks, folder):
    """Run blocks of a page in one process; return what they print."""
    done = subprocess.run(
        [sys.executable, "-c", "\n".join(blocks)], cwd=folder, capture_output=True, text=True, check=False
    )
    assert done.returncode == 0, done.stderr[-3000:]
    return done.stdout


def test_the_python_page_without_its_explanation(tmp_path):
    """The calls of that block, which takes half a minute, are those of tests/api/test_diagnose_simulate_explain.py."""
    blocks = [block for block in documents.fenced(HOW_TO / "python.md", "python") if "etb.explain" not in block]
    assert len(blocks) > 4
    assert "fail" in run_together(blocks, tmp_path)
    assert (tmp_path / "signals.csv").is_file()


@pytest.mark.study
def test_the_python_page_as_its_reader_types_it(tmp_path):
    told = run_together(documents.fenced(HOW_TO / "python.md", "python"), tmp_path)
    assert "parameter:stiction" in told
    assert {path.name for path in tmp_path.iterdir()} >= {"signals.csv", "extended.yaml", "before_and_after.png"}


def test_the_measurement_of_the_how_to_keeps_its_contract(tmp_path):
    (block,) = documents.fenced(HOW_TO / "own_measurement.md", "python")
    path = tmp_path / "dash_current.py"
    path.write_text(block, "utf-8")
    plugins.load(path)
    try:
        testing.check_measurement(measurement_kinds()["dash_current"], "friction_check")
    finally:
        plugins.unload(path)


def test_the_test_of_the_ci_page(tmp_path):
    (block,) = documents.fenced(HOW_TO / "ci.md", "python")
    (tmp_path / "test_unit.py").write_text(block, "utf-8")
    done = subprocess.run(
        [sys.executable, "-m", "pytest", "-q", "-p", "no:cacheprovider", "test_unit.py"],
        cwd=tmp_path, capture_output=True, text=True, check=False,
    )  # fmt: skip
    assert done.returncode == 0, done.stdout[-3000:]
    assert "1 passed" in done.stdout


@pytest.mark.parametrize("page", documents.PAGES, ids=lambda page: page.stem)
def test_yaml_of_a_page_is_a_part_of_a_file(page, tmp_path):
    for block in documents.fenced(page, "yaml"):
        part_of_a_file = tmp_path / "part.yaml"
        part_of_a_file.write_text(block, "utf-8")
        shown, _ = parse(part_of_a_file)
        schemas = [file_schema(kind) for kind in KINDS]
        fits = [one for one in schemas if shown.keys() <= one["properties"].keys()]
        assert fits, (page.name, list(shown))
        faults = []
        for schema in fits:
            part = jsonschema.Draft202012Validator(without_needs(schema))
            faults.append([error.message for error in part.iter_errors(shown)])
        assert [] in faults, (page.name, faults)


def without_needs(schema):
    """Return a schema that a part of a file fits, too."""
    if isinstance(schema, list):
        return [without_needs(one) for one in schema]
    if not isinstance(schema, dict):
        return schema
    return {key: without_needs(value) for key, value in schema.items() if key != "required"}


def test_sql_of_the_pages(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    assert main(["run", "--serial", "S-1", "--unit", "faulty", "--yes"]) == 10
    (log,) = tmp_path.glob("sessions/*/raw.blf")
    main(["replay", str(log), "--bench", "virtual_classic", "--jobs", "1", "--out", "verdicts"])
    with sqlite3.connect(tmp_path / "sessions" / "results.db") as store:
        (query,) = documents.fenced(HOW_TO / "store.md", "sql")
        assert [row[0] for row in store.execute(query)] == ["S-1"]
    (queries,) = documents.fenced(documents.DOCS / "reference" / "logs.md", "sql")
    for query in filter(str.strip, queries.split(";")):
        assert duckdb.sql(query).fetchall()


def test_every_language_of_a_page_has_a_test():
    known = {"yaml", "python", "sql", "toml"}  # pyproject.toml of plug-ins: docs/examples/plugin is one
    for page in documents.PAGES:
        named = documents.languages(page)
        assert named <= known | {
            "{code-block}",
            "{code-cell}",
            "{toctree}",
            "{literalinclude}",
            "{include}",
            "{glossary}",
        }, (
            page.name,
            named,
        )
