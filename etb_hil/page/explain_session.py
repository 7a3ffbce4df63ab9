"""Explain a session for the page, in a process of its own.

Its argument is the session.

It prints what it does, a JSON text a line, and leaves the answer in the session's folder `explanation`.
"""

from __future__ import annotations

import json
import signal
import sys
from pathlib import Path

from etb_hil.api.explaining import explain, model_of
from etb_hil.base.errors import EtbHilError
from etb_hil.page.explaining import LONGEST_SAID
from etb_hil.page.session_files import EXPLANATION


def main() -> int:
    """Explain the session that the argument names.

    SIGTERM ends the search with what is known by then.
    """
    signal.signal(signal.SIGTERM, signal.default_int_handler)  # SIGINT is ignored where a script began the page
    folder = Path(sys.argv[1])
    try:
        answer = explain(folder, progress=_say)
        answer.write(folder / EXPLANATION, [folder, model_of(folder)])
    except (EtbHilError, OSError, KeyboardInterrupt) as error:
        _say(str(error))
        return 2
    except Exception as error:
        _say(f"{type(error).__name__}: {error}")  # nobody reads what a traceback says there
        raise
    _say(answer.verdict)
    return 0


def _say(what: str) -> None:
    print(json.dumps(what[:LONGEST_SAID]), flush=True)  # noqa: T201 (the page reads it)


if __name__ == "__main__":
    sys.exit(main())
