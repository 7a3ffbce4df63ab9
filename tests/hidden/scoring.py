"""Score an explanation against the sealed truth, and rates with exact bounds."""

from collections import Counter
from dataclasses import dataclass

from scipy.stats import beta

# Names under which a base parameter may be reported: by model file, by the equations' vector, by the generator.
_SAME_PARAMETER = (
    {"motor_constant", "back_emf_constant", "torque_constant", "back_emf", "torque_per_ampere"},
    {"motor_inertia", "throttle_inertia", "plate_inertia", "inertia"},
)
_NAMED = 2  # of several effects: both of a pair, two of three
VISIBLE = 1.5  # residual over noise after calibration from which the goals ask for a name


@dataclass(frozen=True)
class Score:
    """Outcome of one file.

    `outcome`: `right`, `honest` (nothing wrong claimed, less said than could be), `unexplained`, `adequate`,
    `insufficient_data`, `wrong_class` or `wrong_confident`; `best_in_class`: the most probable cause, whatever
    the verdict, is the truth or a look-alike of it; `visible`: still there after calibration within tolerances;
    `separable`: nothing in the catalogue and no base parameter looks like it in these data.
    """

    kind: str
    level: str
    effects: tuple
    outcome: str
    best_in_class: bool
    visible: bool
    separable: bool


def canonical(name):
    """An effect's id with one name for each base parameter."""
    if not name.startswith("parameter:"):
        return name
    bare = name.removeprefix("parameter:")
    return "parameter:" + next((min(group) for group in _SAME_PARAMETER if bare in group), bare)


def score(explanation, truth, *, removed=False, declared=()):
    """Score an `explanation.json` (dict) against a sealed truth (dict).

    `removed`: the tool's catalogue lacked the true effect's own term, so that its look-alikes are the best it can name;
    `declared`: those that the catalogue itself states for it.
    """
    verdict = explanation["verdict"]
    causes = [_names(cause) for cause in explanation.get("causes", [])]
    true = tuple(canonical(entry["effect"]) for entry in truth["effects"])
    level = truth["effects"][0]["level"] if truth["effects"] else "none"
    judged = {canonical(entry["effect"]): entry for entry in truth.get("separability", ())}
    alike = {name: _class(judged.get(name)) for name in true}
    visible = any(judged[name]["visible"] >= VISIBLE if name in judged else True for name in true)
    first = causes[0] if causes else ("", frozenset())
    best = bool(true) and any(first[0] in alike[name] | {name} for name in true)
    names_something = verdict in ("explained", "ambiguous") and bool(causes)
    if truth["kind"] == "nothing":
        outcome = "right" if verdict == "adequate" else _named_falsely(verdict, causes) if names_something else verdict
    elif truth["kind"] == "outside":
        outcome = (
            "right" if verdict == "unexplained" else _named_falsely(verdict, causes) if names_something else verdict
        )
    elif not names_something:
        outcome = verdict
    elif truth["kind"] == "several":
        outcome = _several(verdict, causes, true)
    elif removed:
        strangers = [cause for cause in causes if cause[0] not in alike[true[0]] | set(declared)]
        outcome = "wrong_confident" if any(_confident(verdict, cause) for cause in strangers) else "honest"
    else:
        outcome = _single(verdict, causes, true[0], alike[true[0]])
    return Score(truth["kind"], level, true, outcome, best, visible, not any(alike.values()))


def _names(cause):
    others = {canonical(name) for name in cause.get("not_isolable_from", ())}
    name = canonical(cause["id"])
    return name, frozenset(others - {name})


def _class(entry):
    """Ids that the data cannot tell from a hidden effect."""
    if entry is None:
        return set()
    return {*entry["look_alikes"], *(canonical(f"parameter:{name}") for name in entry["parameters"])}


def _confident(verdict, cause):
    return verdict == "explained" and not cause[1]


def _named_falsely(verdict, causes):
    return "wrong_confident" if any(_confident(verdict, cause) for cause in causes) else "wrong_class"


def _single(verdict, causes, true, alike):
    strangers = [cause for cause in causes if true not in cause[1] | {cause[0]}]
    if strangers:
        return _named_falsely(verdict, strangers)
    # A true name alone is right also beside a look-alike: a guess would be wrong as often, and count as that.
    return "right" if alike or _confident(verdict, causes[0]) else "honest"


def _several(verdict, causes, true):
    found = {name for name in true for cause in causes if name in cause[1] | {cause[0]}}
    # A confident cause must be one of them; an effect that the data cannot distinguish from it is a wrong name, too.
    strangers = [cause for cause in causes if not (cause[1] | {cause[0]}) & set(true)]
    if strangers:
        return "wrong_confident" if any(_confident(verdict, c) for c in strangers) else "wrong_class"
    return "right" if len(found) >= _NAMED else "honest"


def clopper_pearson(hits, count, confidence=0.95):
    """Exact bounds of a rate."""
    if not 0 <= hits <= count or count == 0:
        raise ValueError("a rate needs 0 <= hits <= count and a count above 0")
    tail = 0.5 * (1.0 - confidence)
    low = float(beta.ppf(tail, hits, count - hits + 1)) if hits else 0.0
    high = float(beta.ppf(1.0 - tail, hits + 1, count - hits)) if hits < count else 1.0
    return low, high


@dataclass(frozen=True)
class Rate:
    """A share of files with its exact 95 % bounds."""

    hits: int
    count: int
    low: float
    high: float

    @property
    def value(self):
        return self.hits / self.count


def rate(hits, count):
    """A `Rate` of hits in a count."""
    return Rate(hits, count, *clopper_pearson(hits, count))


def aggregate(scores):
    """Rates of every outcome and of `best_in_class`, by (kind, level), over all files and over parts of them.

    Returns {(kind, level, "all" | "visible" | "separable"): {outcome: Rate}}; an outcome that never came is not listed.
    """
    groups = {}
    for item in scores:
        for part, belongs in (("all", True), ("visible", item.visible), ("separable", item.separable)):
            if belongs:
                groups.setdefault((item.kind, item.level, part), []).append(item)
    table = {}
    for key, members in groups.items():
        outcomes = Counter(item.outcome for item in members)
        outcomes["best_in_class"] = sum(item.best_in_class for item in members)
        table[key] = {name: rate(hits, len(members)) for name, hits in outcomes.items()}
    return table
