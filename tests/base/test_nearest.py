"""The name that was probably meant is offered, and nothing where none is near."""

import pytest

from etb_hil.base.nearest import did_you_mean
from etb_hil.cli.main import main


def test_the_nearest_name_is_offered():
    assert did_you_mean("frction_check", ["friction_check", "multisine"]) == "did you mean 'friction_check'?"
    assert did_you_mean("xyz", ["friction_check"], "check the name") == "check the name"


@pytest.mark.parametrize(
    ("words", "meant"),
    [
        (["chek"], "check"),
        (["check", "--bnch", "x"], "--bench"),
        (["check", "frction_check"], "friction_check"),
        (["check", "--bench", "virtual_clasic"], "virtual_classic"),
        (["check", "--model", "defalt"], "default"),
    ],
)
def test_a_mistyped_name_is_answered_with_the_nearest(words, meant, capsys):
    try:
        code = main(words)
    except SystemExit as left:  # argparse's
        code = left.code
    assert code == 2
    said = capsys.readouterr()
    assert f"did you mean '{meant}'?" in said.err + said.out


def test_results_do_not_make_a_mistyped_folder(tmp_path, capsys):
    assert main(["run", "--junit", str(tmp_path / "tpyo" / "j.xml"), "--out", str(tmp_path / "s")]) == 2
    assert "no such folder" in capsys.readouterr().err
    assert not (tmp_path / "tpyo").exists()
