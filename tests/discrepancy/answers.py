"""Answers as the plain values that `explanation.json` holds, to look into and to change; and pages of changed ones."""

from pydantic import TypeAdapter

from etb_hil.report import explain_report
from etb_hil.results.explanation import ExplanationResult
from etb_hil.results.explanation_file import explanation_from_dict


def plain(found):
    """Return the plain values of a result, of a part of one, of several, or of what `explain` returned."""
    if found is None:
        return None
    if isinstance(found, tuple | list):
        return [one if isinstance(one, str) else plain(one) for one in found]
    if isinstance(found, dict):
        return {name: plain(one) for name, one in found.items()}
    found = getattr(found, "explanation", found)
    return TypeAdapter(type(found)).dump_python(found, mode="json", by_alias=True)


def write_explanation(found, series, folder, *, pictures=False):
    """Write the page of a result, or of plain values."""
    typed = found if isinstance(found, ExplanationResult) else explanation_from_dict(found)
    return explain_report.write_explanation(typed, series, folder, pictures=pictures)
