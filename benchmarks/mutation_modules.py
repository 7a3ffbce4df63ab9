"""The modules that decide, and the files of tests that must find their faults."""

from dataclasses import dataclass


@dataclass(frozen=True)
class Tests:
    """Files of tests under `tests/`; kernels run in theirs as plain Python, a hundred times slower."""

    plain: str
    kernels: str = ""

    def tests(self, *, compiled):
        """Return the files for mutants in compiled code, or for the others."""
        return [f"tests/{name}.py" for name in (self.kernels if compiled else self.plain).split()]


HISTORY = "history/test_drift_gauge_rise history/test_tolerance_and_charts"
SHAPES = f"{HISTORY} history/test_shift_and_distribution"
MOTION = "diagnosis/test_motion_not_seen diagnosis/test_step_response"
LIMITS = "diagnosis/test_limit_laws diagnosis/test_limits_file"

MODULES = {
    "base/outcome": Tests("base/test_outcome"),
    "bench/safe_state": Tests("bench/test_seen_off"),
    "bench/runner": Tests(
        "bench/test_runner bench/test_waking bench/test_time_left bench/test_prompts_and_triggers bench/test_seen_off "
        "bench/test_ahead uds/test_uds_in_a_run"
    ),
    "bench/interlock": Tests("bench/test_interlock"),
    "bench/supervision": Tests("bench/test_supervision", "bench/test_supervision"),
    "bench/speed_watch": Tests("bench/test_speed_watch", "bench/test_speed_watch bench/test_supervision"),
    "bench/supply_guard": Tests("bench/test_supply_guard"),
    "bench/command_pause": Tests("bench/test_stop_signals"),
    "bench/beat": Tests(
        "bench/test_beat bench/test_interlock bench/test_ahead bench/test_silent_status uds/test_uds_in_a_run"
    ),
    "bench/stop_signals": Tests("bench/test_stop_signals trusted/test_safe_stop_verbs"),
    "bench/guided": Tests("bench/test_guided"),
    "bench/guided_process": Tests("bench/test_guided"),
    "bench/results": Tests("bench/test_results bench/test_attempts"),
    "cli/batch": Tests("cli/test_batch"),
    "cli/ci_output": Tests("cli/test_ci_output"),
    "cli/replay_options": Tests("replay/test_replay_options"),
    "replays/many_logs": Tests("replay/test_tasks_of_many_logs replay/test_many_logs"),
    "replays/outcome": Tests("replay/test_log_outcome"),
    "station/admission": Tests("station/test_admission"),
    "station/retention": Tests("station/test_retention"),
    "store/run": Tests("store/test_run store/test_store station/test_admission"),
    "session/attempts": Tests("session/test_trying_again"),
    "session/answer_time": Tests("bench/test_answer_time bench/test_supervision"),
    "session/verdict_policy": Tests("canio/test_corruption_doubts bench/test_attempts"),
    "session/baseline": Tests("session/test_baseline"),
    "session/checksum": Tests(
        "session/test_results_changed session/test_session_and_events trusted/test_tampered_session"
    ),
    "session/differences": Tests("session/test_differences session/test_results_changed"),
    "diagnosis/limits": Tests(f"{LIMITS} diagnosis/test_diagnosis_verdicts"),
    "diagnosis/limits_file": Tests(f"{LIMITS} diagnosis/test_new_measurement"),
    "diagnosis/limit_laws": Tests(LIMITS),
    "diagnosis/contradiction": Tests("diagnosis/test_contradiction diagnosis/test_effects_in_the_model"),
    "diagnosis/motion/unseen": Tests(MOTION),
    "diagnosis/motion/repeats": Tests(MOTION),
    "diagnosis/measuring": Tests("diagnosis/test_measuring diagnosis/test_limits_file"),
    "diagnosis/verdict": Tests("diagnosis/test_verdict"),
    "diagnosis/exceedance": Tests("diagnosis/test_exceedance", "diagnosis/test_exceedance"),
    "diagnosis/plausibility": Tests("diagnosis/test_plausibility", "diagnosis/test_plausibility"),
    "histories/capability": Tests(SHAPES),
    "histories/control_chart": Tests(f"{SHAPES} history/test_statistics"),
    "histories/drift": Tests(HISTORY),
    "histories/gauge": Tests(HISTORY),
    "histories/rise": Tests(f"{HISTORY} history/test_statistics"),
    "histories/temperature": Tests("history/test_temperature_laws history/test_statistics"),
    "histories/tolerance": Tests(SHAPES),
    "scenario/condition_watch": Tests("scenario/test_condition_watch"),
    "canio/dbc/reception": Tests("canio/test_reception", "canio/test_reception"),
    "canio/dbc/protection": Tests("canio/test_protection canio/test_decoder", "canio/test_protection"),
}
