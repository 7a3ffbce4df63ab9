"""What is told of many errors at once."""

import pytest

from etb_hil.base.errors import MOST_PROBLEMS, InputError, Problem
from etb_hil.cli.main import main


@pytest.mark.parametrize(("count", "last"), [(MOST_PROBLEMS, "wrong 49"), (MOST_PROBLEMS + 2, "and 2 more")])
def test_an_error_tells_of_so_many_problems_and_counts_the_others(count, last):
    problems = [Problem(f"wrong {number}") for number in range(count)]
    error = InputError(*problems, *problems)
    lines = str(error).splitlines()
    assert (lines[0], lines[MOST_PROBLEMS - 1], lines[-1]) == ("wrong 0", "wrong 49", last)
    assert len(error.problems) == 2 * count


def test_check_tells_of_no_more(tmp_path, capsys):
    path = tmp_path / "long.yaml"
    phases = "".join(f"  - {{id: p{number}}}\n" for number in range(300))
    path.write_text(f"schema: etb_hil/scenario/1\nname: Long\nphases:\n{phases}")
    assert main(["check", str(path), "--bench", "virtual_classic"]) == 2
    wrong = [line for line in capsys.readouterr().out.splitlines() if line.startswith("WRONG")]
    assert len(wrong) == MOST_PROBLEMS + 1
    assert wrong[-1].endswith("and 250 more")
