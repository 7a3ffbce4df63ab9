"""Observers by name: in the registry, in a bench file and on the command line."""

import numpy as np
import pytest
import yaml

from etb_hil.base.errors import InputError
from etb_hil.base.stock import find
from etb_hil.bench.bench_file import load_bench
from etb_hil.observer.estimate import SensorNoise
from etb_hil.observer.registry import DEFAULT, OBSERVERS, observer_kind
from etb_hil.plant.parameters import load_model


def test_the_default_and_the_papers_observer_are_there():
    assert {DEFAULT, "sliding-mode"} <= set(OBSERVERS.names())


@pytest.mark.parametrize("name", OBSERVERS.names())
def test_each_is_made_from_the_bench_model_alone(name):
    model = load_model(find("model", "default"))
    kind = observer_kind(name)
    observer = kind.make(model, model.values, SensorNoise.of_steps(1e-4, 1e-3))
    estimate = observer.push(np.arange(100) * 1_000_000, np.zeros(100), np.full(100, 0.5))
    assert len(estimate.friction) == 100
    assert kind.summary


def test_an_unknown_name_is_refused_with_the_known_ones():
    with pytest.raises(InputError) as refused:
        observer_kind("luenberger")
    for word in ("luenberger", *OBSERVERS.names()):
        assert word in str(refused.value)


def test_a_bench_file_names_its_observer(tmp_path):
    stock = yaml.safe_load(find("bench", "virtual_classic").read_text("utf-8"))
    path = tmp_path / "bench.yaml"
    path.write_text(yaml.safe_dump(stock | {"observer": "sliding-mode"}), "utf-8")
    assert load_bench(path).bench.observer == "sliding-mode"
    path.write_text(yaml.safe_dump(stock | {"observer": "luenberger"}), "utf-8")
    with pytest.raises(InputError, match="no such observer"):
        load_bench(path)
