"""Results are objects: nothing but the file's own module reads them by string keys."""

import ast
from pathlib import Path

import etb_hil

PACKAGE = Path(etb_hil.__file__).parent
READERS = {PACKAGE / "results" / name for name in ("json_file.py", "explanation_file.py")}
OF_RESULTS = (
    "results", "result", "read_results", "result_as_dict", "outcome", "outcomes",
    "explanation", "explanation_as_dict", "cause", "causes",
)  # fmt: skip
# Fields that results alone have: read by these keys, an object of any name is a result.
OWN = {"reason_id", "measurements", "numbers", "exceedances", "exit_code", "timestamp_grade", "limit_low", "limit_high"}
# As file names or roles some fields of an explanation have other uses; those that have none:
OWN |= {
    "in_model", "share_of_error", "rms_over_noise_floor", "nrmse_free_run", "noise_floor_range", "free_run_worst",
    "detection_limits", "expected_separation", "next_test", "data_quality", "break_away_voltage", "used_in_fit",
    "held_out_t", "carried_over", "isolated_from", "not_isolable_from", "residual_share", "explained_share",
}  # fmt: skip


def is_result(node):
    """Return whether an expression stands for results: a name, an attribute or a call of that name."""
    if isinstance(node, ast.Subscript):
        return is_result(node.value)
    if isinstance(node, ast.Call):
        return is_result(node.func)
    name = node.id if isinstance(node, ast.Name) else node.attr if isinstance(node, ast.Attribute) else ""
    return name in OF_RESULTS


def string_keys(tree):
    """Yield the lines at which results are read by a string key."""
    for node in ast.walk(tree):
        key, of = None, None
        if isinstance(node, ast.Subscript) and isinstance(node.ctx, ast.Load):
            key, of = node.slice, node.value
        elif (
            isinstance(node, ast.Call)
            and isinstance(node.func, ast.Attribute)
            and node.func.attr == "get"
            and node.args
        ):
            key, of = node.args[0], node.func.value
        if isinstance(key, ast.Constant) and isinstance(key.value, str) and (is_result(of) or key.value in OWN):
            yield node.lineno


def test_the_walk_finds_string_keys():
    tree = ast.parse(
        "a = results['unit']['verdict']\nb = session.read_results().get('bench')\nc = results.unit.verdict\n"
        "d = row['reason_id']\ne = row['id']"
    )
    assert sorted(set(string_keys(tree))) == [1, 2, 4]


def test_no_module_reads_results_by_string_keys():
    found = [
        f"{path.relative_to(PACKAGE)}:{line}"
        for path in PACKAGE.rglob("*.py")
        if path not in READERS
        for line in string_keys(ast.parse(path.read_text("utf-8")))
    ]
    assert found == []
