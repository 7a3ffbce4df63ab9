"""What every observer keeps to, whichever it is."""

from itertools import pairwise

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from independent_throttle import FAULTY, Unit, friction_check, sense
from throttle_as_model import bench_model, noise, parameters

from etb_hil.observer.estimate import SensorNoise
from etb_hil.observer.kinds.adaptive import AdaptiveObserver
from etb_hil.observer.kinds.angle import AngleObserver
from etb_hil.observer.kinds.sliding_mode import ImplicitSlidingModeObserver, SlidingModeObserver

OBSERVERS = {
    "adaptive": lambda: AdaptiveObserver(parameters(Unit()), noise(), bench_model(Unit()).tolerances),
    "angle": lambda: AngleObserver(parameters(Unit()), noise()),
    "sliding mode": lambda: SlidingModeObserver(parameters(Unit()), noise()),
    "implicit": lambda: ImplicitSlidingModeObserver(parameters(Unit()), noise()),
}

every_observer = pytest.mark.parametrize("make", OBSERVERS.values(), ids=OBSERVERS)


@pytest.fixture(scope="module")
def healthy():
    truth, _ = friction_check(Unit(), creeps=())
    return truth, {
        rate: sense(Unit(), truth, rate, np.random.default_rng(1), current_offset=0.0) for rate in (1000, 20000)
    }


def _push(observer, sensed, part=slice(None)):
    return observer.push(sensed.time_ns[part], sensed.current[part], sensed.motor_angle[part] / 18.0)


@every_observer
@settings(max_examples=20, deadline=None)
@given(cuts=st.lists(st.integers(0, 4000), max_size=12), rate=st.sampled_from([1000, 20000]))
def test_same_bits_however_the_stream_is_cut(make, healthy, cuts, rate):
    sensed = healthy[1][rate]
    whole = _push(make(), sensed, slice(0, 4000))
    observer = make()
    edges = [0, *sorted(cuts), 4000]
    pieces = [_push(observer, sensed, slice(a, b)) for a, b in pairwise(edges)]
    for name in ("velocity", "friction", "delay_ns"):
        np.testing.assert_array_equal(np.concatenate([getattr(p, name) for p in pieces]), getattr(whole, name))


@every_observer
@settings(max_examples=10, deadline=None)
@given(cuts=st.lists(st.integers(0, 6000), max_size=12), seed=st.integers(0, 2**32 - 1))
def test_same_bits_of_a_damaged_stream(make, healthy, cuts, seed):
    """Samples are lost, late and not numbers, and the rate changes: so do gains, between two cuts and across them."""
    sensed, rng = healthy[1][20000], np.random.default_rng(seed)
    keep = rng.random(40000) > 0.01
    keep[2000:38000] &= np.arange(36000) % 20 == 0
    keep[35000:37000] = False
    chosen = np.flatnonzero(keep)
    time_ns, current, angle = sensed.time_ns[chosen], sensed.current[chosen].copy(), sensed.motor_angle[chosen] / 18.0
    time_ns = time_ns + rng.integers(0, 2, len(chosen)) * 5000
    current[rng.integers(0, len(chosen), 4)] = [np.nan, np.inf, -np.inf, np.nan]
    whole, observer = make().push(time_ns, current, angle), make()
    edges = [0, *sorted(cuts), len(chosen)]
    pieces = [observer.push(time_ns[a:b], current[a:b], angle[a:b]) for a, b in pairwise(edges)]
    for name in ("velocity", "friction", "delay_ns"):
        np.testing.assert_array_equal(np.concatenate([getattr(p, name) for p in pieces]), getattr(whole, name))


@every_observer
@pytest.mark.parametrize("rate", [1000, 20000])
def test_friction_of_a_slow_ramp_is_found(make, healthy, rate):
    truth, sensed = healthy[0], healthy[1][rate]
    estimate = _push(make(), sensed)
    ramp = slice(int(2.5 * rate), int(4.4 * rate))
    assert np.mean(estimate.friction[ramp]) == pytest.approx(np.mean(truth.friction[50000:88000]), rel=0.02)
    assert np.mean(estimate.velocity[ramp]) == pytest.approx(0.4, abs=0.02)


@every_observer
@pytest.mark.parametrize(("rate", "lost"), [(1000, 1), (1000, 8), (1000, 60), (20000, 10), (20000, 100), (20000, 4000)])
def test_lost_samples_never_become_a_spike(make, healthy, rate, lost):
    """A gap costs no more in the tenth of a second after it than the whole shows without one, beyond a tenth of T_st.

    Later, the ripple of an explicit sign differs by its phase, gap or not.
    """
    sensed = healthy[1][rate]
    unbroken = _push(make(), sensed)
    keep, after = np.ones(len(sensed.time_ns), bool), np.zeros(len(sensed.time_ns), bool)
    for at in np.arange(1.3, 13.0, 0.35):
        first = int(at * rate)
        keep[first : first + lost] = False
        after[first + lost : first + lost + rate // 10] = True
    broken = _push(make(), sensed, keep)
    highest = np.nanmax(np.abs(unbroken.friction))
    assert np.nanmax(np.abs(broken.friction[after[keep]])) < highest + 0.1 * Unit().stiction


@every_observer
@pytest.mark.parametrize("bad", [np.nan, np.inf, -np.inf])
@pytest.mark.parametrize("column", [0, 1])
def test_bad_samples_give_no_estimate_and_do_no_harm(make, healthy, bad, column):
    sensed = healthy[1][1000]
    columns = (sensed.current.copy(), sensed.motor_angle / 18.0)
    columns[column][2000:2003] = bad
    estimate = make().push(sensed.time_ns, *columns)
    assert np.all(np.isnan(estimate.friction[2000:2003]))
    assert np.all(np.isfinite(estimate.friction[2100:]))


@every_observer
def test_rate_that_changes_while_it_runs(make, healthy):
    """A burst at 20 kHz in a stream at 1 kHz keeps the estimate within what the slower rate shows."""
    truth, sensed = healthy[0], healthy[1][20000]
    keep = np.zeros(len(sensed.time_ns), bool)
    keep[::20] = True
    keep[60000:80000] = True
    estimate = _push(make(), sensed, keep)
    ramp = (estimate.time_ns > 2.6e9) & (estimate.time_ns < 4.4e9)
    error = estimate.friction[ramp] - truth.friction[keep][ramp]
    assert np.all(np.isfinite(error))
    assert np.abs(np.mean(error)) < 0.02 * Unit().stiction


@pytest.mark.parametrize("rate", [1000, 20000])
def test_stated_delay_is_the_one_that_fits(rate):
    truth, _ = friction_check(FAULTY, creeps=())
    sensed = sense(FAULTY, truth, rate, np.random.default_rng(2), current_offset=0.0)
    estimate = _push(OBSERVERS["angle"](), sensed)
    every = 20000 // rate
    inside = slice(int(1.2 * rate), int(13.0 * rate))

    def error(delay_ns):
        late = round(delay_ns * 1e-9 * 20000)
        shifted = truth.friction[inside.start * every - late : inside.stop * every - late : every]
        return np.sqrt(np.mean((estimate.friction[inside] - shifted) ** 2))

    stated = int(estimate.delay_ns[-1])
    assert error(stated) < 0.8 * error(0)
    assert error(stated) < 1.1 * min(error(d) for d in range(0, 4_000_000, 250_000))


@pytest.mark.parametrize("make", [OBSERVERS[name] for name in OBSERVERS if name != "adaptive"])
@pytest.mark.parametrize("rate", [1000, 20000])
def test_stated_delay_is_the_lag_behind_a_slow_change(make, rate):
    """A plate slides steadily while its friction swings by a tenth, twice a second: known without any simulation."""
    p, time, swing = parameters(Unit()), np.arange(3 * rate) / rate, 4.0 * np.pi
    angle, friction = 0.25 + 0.3 * time, p.coulomb * (1.0 + 0.1 * np.sin(swing * time))
    current = (p.preload_open + p.slope_open * (angle - p.limp_home) + friction) / p.torque_per_ampere
    estimate = make().push(np.round(time * 1e9).astype(np.int64), current, angle)
    late = slice(rate, None)
    turning = np.exp(-1j * swing * time[late])
    found, true = (np.sum((each[late] - each[late].mean()) * turning) for each in (estimate.friction, friction))
    stated = float(np.mean(estimate.delay_ns[late])) * 1e-9
    assert abs(found / true) == pytest.approx(1.0, abs=0.01)
    assert -np.angle(found / true) / swing == pytest.approx(stated, rel=0.03, abs=0.55 / rate)


@pytest.mark.parametrize("kind", [SlidingModeObserver, ImplicitSlidingModeObserver])
def test_velocity_may_be_measured(healthy, kind):
    truth, sensed = healthy[0], healthy[1][20000]
    observer = kind(parameters(Unit()), noise())
    estimate = observer.push(sensed.time_ns, sensed.current, sensed.motor_angle / 18.0, truth.velocity)
    late = round(int(estimate.delay_ns[0]) * 1e-9 * 20000)
    error = estimate.friction[24000:260000] - truth.friction[24000 - late : 260000 - late]
    assert np.sqrt(np.mean(error**2)) < 0.06 * Unit().coulomb


def test_noise_of_sensors_that_round():
    noise = SensorNoise.of_steps(12.0, 0.0, angle_noise=2.0, current_noise=3.0)
    assert noise.angle == pytest.approx(4.0)
    assert noise.current == pytest.approx(3.0)
