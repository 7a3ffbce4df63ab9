"""Each quantity has one name, the one of its declaration, wherever a person reads it."""

import io

import pytest
import sample_run
from history import made_up
from rich.console import Console

from etb_hil.base.outcome import UnitVerdict
from etb_hil.bench.wording import unit_wording
from etb_hil.diagnosis.measurement_registry import measurement_kinds, name_of
from etb_hil.histories.history import histories
from etb_hil.plant.names import display_name
from etb_hil.report.history_text import history_text
from etb_hil.report.panel_feed import PanelSnapshot
from etb_hil.report.panel_view import draw
from etb_hil.results.measurement import Measurement, Measurements
from etb_hil.results.run_result import Unit
from etb_hil.results.shown import heading

KINDS = measurement_kinds()


def test_no_two_measurements_have_the_same_name():
    names = [kind.name.casefold() for kind in KINDS.values()]
    assert len(set(names)) == len(names)


@pytest.mark.parametrize("name", KINDS)
@pytest.mark.parametrize("ending", ["beyond_limit", "undecided", "not_measured", "without_signal", "without_interval"])
def test_a_reason_begins_with_the_declared_name(name, ending):
    kind = KINDS[name]
    measured = [Measurement(name, kind.name, 2.0, kind.unit, 1.5, 2.5, None, 1.0, UnitVerdict.FAIL)]
    for found in ([], measured):
        results = sample_run.results(unit=Unit(UnitVerdict.FAIL, f"{name}_{ending}"), measurements=Measurements(found))
        assert unit_wording(results).reason.casefold().startswith(f"{kind.name} ".casefold())


def test_one_of_several_values_has_the_name_with_what_sets_it_apart():
    assert name_of("step_rise_large_opening") == f"{KINDS['step_rise'].name} (large opening)"
    assert name_of("holding_current_2") == f"{KINDS['holding_current'].name} (2)"
    assert name_of("of_no_measurement") == "of_no_measurement"


@pytest.mark.parametrize(
    ("parameter", "measurement"),
    [("stiction", "T_st"), ("coulomb", "T_c"), ("stribeck_velocity", "omega_s"), ("viscous", "viscous")],
)
def test_a_parameter_has_the_name_of_its_measurement(parameter, measurement):
    assert display_name(parameter) == KINDS[measurement].name


def test_the_panel_has_the_declared_names():
    screen = io.StringIO()
    Console(file=screen, width=80).print(draw(PanelSnapshot(stiction=0.171, coulomb=0.145)))
    said = [" ".join(line.strip("│ \n").split()) for line in screen.getvalue().splitlines()]
    assert f"{KINDS['T_st'].name} 0.171 N·m" in said
    assert f"{KINDS['T_c'].name} 0.145 N·m" in said


def test_a_history_has_the_declared_names():
    text = history_text(histories(made_up.production(9, 30, warm=30.0, benches=("x", "y")))[0], 5).splitlines()
    assert {"Break-away friction (T_st)", "Sliding friction (T_c)", "Return margin"} <= set(text)


@pytest.mark.parametrize(
    ("measurement", "said"),
    [("T_st", "Break-away friction (T_st)"), ("return_margin", "Return margin"),
     ("step_delay_small_opening", "Step delay (small opening)")],
)  # fmt: skip
def test_an_id_that_repeats_the_name_is_left_out(measurement, said):
    assert heading(measurement, name_of(measurement)) == said


def test_an_id_that_repeats_the_name_is_left_out_of_a_listing():
    (line,) = repr(Measurements([Measurement("return_margin", "return margin", 0.1, "N·m")])).splitlines()[1:]
    assert line.split() == ["return_margin", "0.100", "N·m"]
