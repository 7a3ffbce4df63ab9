"""Results beside their checksum, and what two judgements of one measurement differ in."""

import hashlib

import pytest

from etb_hil.base.errors import InputError
from etb_hil.base.outcome import BenchOutcome, UnitVerdict
from etb_hil.results.measurement import Measurement, Measurements
from etb_hil.results.run_result import Bench, RunResult, Unit
from etb_hil.session.checksum import SUMS, require_unchanged, write_checked
from etb_hil.session.differences import changes, changes_text


def test_results_that_were_changed_are_not_believed(tmp_path):
    path = write_checked(tmp_path / "own.json", "äöü\n", (), "make room")
    digest = hashlib.sha256("äöü\n".encode()).hexdigest()
    assert (tmp_path / SUMS).read_text("utf-8") == f"{digest}  own.json\n"
    require_unchanged(path)
    path.write_text("äöü \n", "utf-8")
    with pytest.raises(InputError, match="was changed after the run"):
        require_unchanged(path)
    write_checked(path, "other\n", (), "make room")
    require_unchanged(path)
    (tmp_path / SUMS).unlink()
    path.write_text("of an earlier version", "utf-8")
    require_unchanged(path)


def judged(verdict="pass", value=0.17, **limits):
    measured = [] if value is None else [Measurement("T_st", "break-away friction", value, "N·m", **limits)]
    return RunResult("run", Unit(UnitVerdict(verdict)), Bench(BenchOutcome.OK), measurements=Measurements(measured))


def test_only_what_changed_is_named():
    assert changes(judged(), judged()) == []
    assert changes_text([]) == "  Nothing changed."
    assert changes(judged(), judged("fail")) == [("verdict", "pass", "fail")]
    ((what, before, now),) = changes(judged(value=0.17), judged(value=0.17 + 1e-12))
    assert (what, before, now) == ("break-away friction", "0.17 N·m", f"{0.17 + 1e-12!r} N·m")
    ((what, before, now),) = changes(judged(), judged(limit_high=0.26))
    assert what == "break-away friction, upper limit"
    assert before == "-"
    assert now.endswith("N·m")
    assert changes(judged(value=None), judged())[0][0] == "break-away friction"


def test_the_table_has_columns():
    text = changes_text([("verdict", "pass", "fail"), ("exceedances", "0", "12")])
    assert text == "               before  now\n  verdict      pass    fail\n  exceedances  0       12"
