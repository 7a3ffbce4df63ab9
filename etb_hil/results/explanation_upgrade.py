"""Upgrade of an `explanation.json` of an earlier schema: its keys, renamed."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

from etb_hil.results.explanation import SCHEMA

READ = ("etb_hil/explanation/1", "etb_hil/explanation/2")  # the earlier schemas that can be upgraded

_ANY = "*"  # an item of a list, or a key that is a name
_RUN = {"begins_s": "start_s", "seen_by_the_fit": "used_in_fit", "breaks_away_at_V": "break_away_voltage"}
_VOLTAGES = {"measured": "measured_v", "model": "model_v"}
_MODELS = {"nominal": "reference", "followed": "fitted_in_free_run"}
# The new names of keys, by the place of the object that has them.
_NEW: dict[tuple[str, ...], dict[str, str]] = {
    (): {"suspects": "candidates", "told_apart_by_others": "isolations", "left_out": "rejected_recordings"},
    ("causes", _ANY): {"effect": "id", "class": "not_isolable_from"},
    ("suspects", _ANY): {
        "search": "selection_step",
        "effect": "id",
        "taken_in": "accepted",
        "refused": "rejection",
        "leaves": "residual_share",
    },
    ("measured", _ANY): {"judges": "candidate", "stated": "nominal"},
    ("told_apart_by_others", _ANY): {"effect": "cause", "tells_from": "isolated_from"},
    ("transfer", _ANY): {"effect": "cause", "gain": "explained_share", "says": "text"},
    ("transfer", _ANY, "free_run"): {"without": "without_cause", "with": "with_cause"},
    ("model_file",): {"numbers_of": "values_from", "says": "text"},
    ("nuisances",): {
        "current_skew": "current_time_offset",
        "voltage_skew": "voltage_time_offset",
        "plate_skew": "plate_time_offset",
        "voltage_late": "voltage_time_offset",
    },
    ("friction", _ANY): {"nominal": "reference"},
    ("diagnosis",): {"says": "text", "stated": "reference"},
    ("balances", _ANY, _ANY): {
        "calibrated_over_floor": "calibrated_over_noise_floor",
        "extended_over_floor": "extended_over_noise_floor",
        "rows": "samples",
    },
    ("unexplained",): {"placeholders": "nonparametric_terms", "says": "text"},
    ("unexplained", "where", _ANY): {"rms_over_floor": "rms_over_noise_floor"},
    ("unexplained", "placeholders", _ANY): {"share_of_rest": "explained_share"},
    ("unexplained", "runs", _ANY): _RUN,
    ("unexplained", "runs", _ANY, "breaks_away_at_V"): _VOLTAGES,
    ("runs", _ANY): _RUN,
    ("runs", _ANY, "breaks_away_at_V"): _VOLTAGES,
    ("detection_limits", _ANY): {"says": "text", "where": "valid_range"},
    ("data_quality", _ANY): {"seconds": "duration_s"},
    ("confounded", _ANY): {"these": "conditions", "says": "text"},
    ("errors",): {"says": "text"},
    ("errors", "holdout", _ANY, _ANY): _MODELS,
    ("errors", "nrmse_free_run"): _MODELS,
    ("gain",): {"over_stated": "over_reference"},
    ("starts",): {"says": "text"},
    ("next_test",): {"says": "text", "by_hand": "bench_steps"},
    ("next_test", "expected_separation"): {"parts": "isolated", "leaves": "not_isolated"},
    ("next_test", "by_hand", _ANY): {"do": "instruction", "gives": "parameters"},
}


def upgraded(data: Mapping[str, Any]) -> dict[str, Any]:
    """Return the contents of an earlier `explanation.json` with the present keys."""
    return {**_renamed(data, ()), "schema": SCHEMA}


def _renamed(value: Any, place: tuple[str, ...]) -> Any:  # noqa: ANN401 (any value that JSON holds)
    if isinstance(value, Mapping):
        new = next((names for pattern, names in _NEW.items() if _is_at(place, pattern)), {})
        return {new.get(key, key): _renamed(one, (*place, key)) for key, one in value.items()}
    if isinstance(value, list | tuple):
        return [_renamed(one, (*place, _ANY)) for one in value]
    return value


def _is_at(place: Sequence[str], pattern: Sequence[str]) -> bool:
    return len(place) == len(pattern) and all(its in (_ANY, name) for its, name in zip(pattern, place, strict=True))
