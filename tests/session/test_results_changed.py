"""Results beside their checksum, and what two judgements of one measurement differ in."""

import hashlib
from dataclasses import replace

import pytest
from hypothesis import given
from hypothesis import strategies as st

from etb_hil.base.errors import InputError
from etb_hil.base.outcome import BenchOutcome, UnitVerdict
from etb_hil.base.userfile import digest
from etb_hil.results.measurement import Measurement, Measurements
from etb_hil.results.run_result import Bench, Exceedance, RunResult, Unit
from etb_hil.session.checksum import SUMS, Sum, require_unchanged, sum_of, write_checked
from etb_hil.session.differences import changes, changes_text


def test_results_that_were_changed_are_not_believed(tmp_path):
    path = write_checked(tmp_path / "own.json", "äöü\n", (), "make room")
    sha256 = hashlib.sha256("äöü\n".encode()).hexdigest()
    assert (tmp_path / SUMS).read_text("utf-8") == f"{sha256}  own.json\n"
    require_unchanged(path)
    path.write_text("äöü \n", "utf-8")
    with pytest.raises(InputError, match="was changed after the run"):
        require_unchanged(path)
    write_checked(path, "other\n", (), "make room")
    require_unchanged(path)
    (tmp_path / SUMS).unlink()
    path.write_text("of an earlier version", "utf-8")
    require_unchanged(path)


@pytest.mark.parametrize("name", ["own.json", "a  b.json", " äö ", "two words"])
def test_a_name_with_spaces_is_told_from_others(tmp_path, name):
    other = tmp_path / f"x  {name}"
    other.write_text("beside it")
    path = write_checked(tmp_path / name, "text\n", [other], "make room")
    assert sum_of(path) is sum_of(other) is Sum.RIGHT
    path.write_text("beside it")
    assert sum_of(path) is Sum.WRONG
    assert sum_of(tmp_path / "x") is Sum.NONE


LINES = st.lists(st.sampled_from(["", "own.json", "  own.json", "abc", "abc  own.json", "abc own.json", "\0\xff"]))


@pytest.fixture(scope="module")
def checked(tmp_path_factory):
    return write_checked(tmp_path_factory.mktemp("checked") / "own.json", "text\n", (), "make room")


@given(LINES, st.booleans(), LINES)
def test_whatever_stands_beside_a_checksum_hides_and_forges_none(checked, before, is_covered, after):
    own = [f"{digest(checked)}  own.json"] if is_covered else []
    (checked.parent / SUMS).write_text("\n".join([*before, *own, *after]), "utf-8")
    has_other = any(line in {"  own.json", "abc  own.json"} for line in before + after)
    assert sum_of(checked) is (Sum.RIGHT if is_covered else Sum.WRONG if has_other else Sum.NONE)


def judged(verdict="pass", value=0.17, verdict_of=None, **limits):
    friction = Measurement("T_st", "break-away friction", value, "N·m", verdict=verdict_of, **limits)
    measured = [] if value is None else [friction]
    return RunResult("run", Unit(UnitVerdict(verdict)), Bench(BenchOutcome.OK), measurements=Measurements(measured))


def bounded(high):
    bound = Measurement("T_st", "break-away friction", None, "N·m", 0.0, high)
    return replace(judged(), measurements=Measurements([bound]))


def test_only_what_changed_is_named():
    assert changes(judged(), judged()) == []
    assert changes_text([]) == "  Nothing changed."
    assert changes(judged(), judged("fail")) == [("verdict", "pass", "fail")]
    ((what, before, now),) = changes(judged(value=0.17), judged(value=0.17 + 1e-12))
    assert (what, before, now) == ("break-away friction", "0.17 N·m", "0.170000000001 N·m")
    ((what, before, now),) = changes(judged(), judged(limit_high=0.26))
    assert what == "break-away friction, upper limit"
    assert before == "-"
    assert now.endswith("N·m")
    assert changes(judged(value=None), judged()) == [("break-away friction", "-", "0.170 N·m")]
    assert changes(judged(), judged(value=None)) == [("break-away friction", "0.170 N·m", "-")]
    lower, higher, lifted = (bounded(high) for high in (0.15, 0.25, 0.15 + 1e-12))
    assert changes(lower, bounded(0.15)) == []
    assert changes(lower, higher) == [("break-away friction", "at most 0.150 N·m", "at most 0.250 N·m")]
    assert changes(lower, lifted) == [("break-away friction", "at most 0.15 N·m", "at most 0.150000000001 N·m")]
    assert changes(judged(value=0.15), lower) == [("break-away friction", "0.150 N·m", "at most 0.150 N·m")]
    assert changes(judged(verdict_of="pass"), judged(verdict_of="fail")) == [
        ("break-away friction, verdict", "pass", "fail")
    ]


def test_the_number_of_exceedances_is_compared():
    episode = Exceedance("T_st", 1.0, 1.5, 0.3, 0.26)
    more = replace(judged(), exceedances=(episode, episode))
    assert changes(judged(), more) == [("exceedances", "0", "2")]
    assert changes(more, replace(more, exceedances=(episode, replace(episode, peak=0.4)))) == []


def test_the_table_has_columns():
    text = changes_text([("verdict", "pass", "fail"), ("exceedances", "0", "12")])
    assert text == "               before  now\n  verdict      pass    fail\n  exceedances  0       12"
