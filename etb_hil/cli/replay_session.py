"""A session judged again, and what of it changed."""

from __future__ import annotations

from typing import TYPE_CHECKING

from etb_hil.base.outcome import ExitCode
from etb_hil.cli.lines import columns, say
from etb_hil.cli.replay_options import against_baseline, baseline_of, own_rules, window_of
from etb_hil.replays.session_replay import replay
from etb_hil.report.verdict import verdict_text
from etb_hil.session.differences import changes, changes_text, compare_with_live, first_divergence
from etb_hil.session.record import CUT_SHORT

if TYPE_CHECKING:
    import argparse

    from etb_hil.session.finished import Finished


def replay_session(options: argparse.Namespace) -> int:
    """Judge a session, and print what differs from live; return the exit code."""
    baseline = baseline_of(options)
    model, limits = own_rules(options)
    finished = replay(options.sources[0], model, limits, window_of(options), options.observer)
    print(verdict_text(finished.results, columns=columns()))
    for note in (*finished.warnings, *finished.analysis.recording.notes):
        say("Note", note)
    return against_baseline(baseline, finished.results, _compared(options, finished))


def _compared(options: argparse.Namespace, finished: Finished) -> int:
    """Print how a judgement differs from the live one; return the exit code.

    The judgement may also be compared with another session.
    """
    other = any(own_rules(options)) or options.observer or options.window
    if options.against:
        return compared(options, finished)
    if not finished.session.has_results and not other:
        finished.session.write_results(finished.results, has_ended=finished.record.reason_id != CUT_SHORT)
        say("", "The run was cut short before it left results; these are in its folder now.")
    elif not finished.session.has_results:
        say("", "The run was cut short before it left results: there is nothing to compare with.")
    elif other:
        print(changes_text(changes(finished.session.read_results(), finished.results)))
    else:
        found, code = compare_with_live(finished)
        say("", "The same results as live, bit for bit." if found is None else f"Differs from live: {found}")
        return code
    return finished.results.code


def compared(options: argparse.Namespace, finished: Finished) -> int:
    """Print where a judgement first differs from that of `--against`.

    Return the exit code.
    """
    other = replay(options.against, window=window_of(options))
    divergence = first_divergence(finished, other)
    print(changes_text(changes(other.results, finished.results)))
    if divergence is None:
        say("", "Every sample and every estimate is that of the session, bit for bit.")
        return finished.results.code
    say("", f"First divergence: {divergence}")
    return finished.results.code or ExitCode.INCONCLUSIVE
