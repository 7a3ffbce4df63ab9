"""The seed paper's simulations: its figures, its properties against an independent solver, and the command."""

import re

import numpy as np
import pytest
from scipy.integrate import solve_ivp

from etb_hil.base.outcome import UnitVerdict
from etb_hil.cli.main import main
from etb_hil.paper.estimation import estimate, numbers_of, paper_settings
from etb_hil.paper.properties import bristles_along, passage, slow_enough
from etb_hil.paper.reproduce import is_as_the_paper_says, reproduce
from etb_hil.paper.setups import controlled, faulty, healthy, sinusoid
from etb_hil.paper.text import document


@pytest.fixture(scope="module")
def folder(tmp_path_factory):
    return tmp_path_factory.mktemp("reproduction")


@pytest.fixture(scope="module")
def done(folder):
    return reproduce(folder)


def test_figures_show_what_the_paper_says_of_them(done):
    assert is_as_the_paper_says(done) == []


def test_estimated_coulomb_friction_is_right_where_the_plate_is_fast(done):
    for one in done.set_ups:
        assert one.numbers.coulomb == pytest.approx(one.numbers.true_coulomb, rel=0.03)
        assert one.numbers.coulomb_literal > one.numbers.coulomb


def test_fit_does_not_underestimate_where_the_peak_does(done):
    """From a noisy current and a quantised encoder, with a model that is off; the middle of the way is not seen."""
    for one in done.set_ups:
        number = one.diagnosis.measurements.get("T_st")
        assert number.low <= one.numbers.true_stiction <= number.high
        assert number.value == pytest.approx(one.numbers.true_stiction, rel=0.02)
        expected = UnitVerdict.FAIL if one.figure in {6, 7} else UnitVerdict.INCONCLUSIVE
        assert one.diagnosis.verdict is expected
        assert "places_not_seen" in {reason.id for reason in one.diagnosis.reasons}
        if expected is UnitVerdict.INCONCLUSIVE:
            assert one.diagnosis.reasons[0].id == "places_not_seen"


def test_filter_alone_takes_less_from_the_peak_the_higher_its_cutoff(done):
    for one in done.trades.values():
        assert np.all(np.diff(one.filtered[0]) > -1e-3)
        assert one.filtered[0, -1] == pytest.approx(one.reached, abs=2e-3)


def test_larger_m_and_higher_cutoff_mean_more_ripple(done):
    for one in done.trades.values():
        assert np.all(np.diff(one.ripple[:, -1]) > 0.0)
        assert np.all(np.diff(one.ripple[:, 3:], axis=1) > 0.0)


def test_explicit_sign_stays_with_the_friction_through_hard_braking():
    """The sign compares velocities of one instant: else the plate's acceleration passes for an observer's error."""
    motion = controlled(healthy(), lambda time: (np.where(time < 0.6, 0.4, 1.2), np.zeros(len(time))), 1.2)
    found = estimate(motion, paper_settings(120.0))
    braking = motion.counted & (motion.time > 0.61) & (np.abs(np.gradient(motion.velocity, motion.time)) > 500.0)
    assert braking.any()
    assert np.abs((found.friction - motion.friction)[braking]).max() < 0.012


def test_bristles_against_an_independent_solver():
    unit = faulty()
    time = np.linspace(0.0, 0.6, 60_001)
    velocity = 6.0 * np.sin(2.0 * np.pi * 5.0 * time)

    def rate(t, z):
        omega = 6.0 * np.sin(2.0 * np.pi * 5.0 * t)
        g = unit.coulomb + (unit.stiction - unit.coulomb) * np.exp(-((omega / unit.stribeck_velocity) ** 2))
        return omega - unit.bristle_stiffness * abs(omega) / g * z

    start = 0.5 * unit.stiction / unit.bristle_stiffness
    exact = solve_ivp(rate, (0.0, 0.6), [start], method="LSODA", t_eval=time[::100], rtol=1e-10, atol=1e-14)
    found = bristles_along(velocity, time[1], start, unit)[::100]
    np.testing.assert_allclose(found, exact.y[0], atol=2e-6 * unit.stiction)


def test_properties(done):
    for bound in (done.properties.healthy, done.properties.faulty):
        assert bound.bristles <= 1.0
        assert bound.steady < 1e-6
    for one in done.properties.passages:
        assert one.zeros >= 1
        assert one.bristles == pytest.approx(1.0, abs=0.02)
        assert one.end == pytest.approx(1.0, abs=1e-3)


def test_how_slow_is_slow_enough_goes_with_the_square_of_omega_s():
    single, double = (slow_enough(faulty(), factor) for factor in (1.0, 2.0))
    assert double.acceleration / single.acceleration == pytest.approx(4.0, rel=0.05)
    assert passage(faulty(), 1.0, 0.5 * single.acceleration).bristles > 0.98 > passage(faulty(), 1.0, 4 * 13.5).bristles


def test_other_readings_are_in_numbers(done):
    text = " ".join(f"{one.place} {one.printed} {one.taken} {one.other}" for one in done.readings)
    assert "nan" not in text
    for place in ("0.00315", "omega_s", "Kg·m/s²", "LPF", "30 rad/s", "exponent", "K_e and K_t", "property 2", "sigma"):
        assert place in text


def test_page_shows_every_picture(done, folder):
    named = set(re.findall(r"\]\((.*?\.png)\)", document(done)))
    assert named == {path.name for path in folder.glob("*.png")}


def test_higher_cutoff_remedies_the_underestimate_as_the_paper_says():
    motion = controlled(faulty(), sinusoid(), 1.5)
    short = [numbers_of(motion, estimate(motion, paper_settings(c))).underestimated for c in (30, 60, 120)]
    assert short[0] > short[1] > short[2] > 0.0


def test_folder_that_cannot_be_written_is_bad_input(tmp_path, capsys):
    (tmp_path / "file").write_text("in the way")
    assert main(["reproduce", "--out", str(tmp_path / "file")]) == 2
    assert "cannot be written" in capsys.readouterr().err
