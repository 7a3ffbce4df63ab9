"""python-can imports asammdf wherever it is installed, and with it pandas: half a second that hardly a command needs.

A process of ours hides it; who reads an MF4 file that only asammdf knows brings it back. A library that uses this
package hides nothing.
"""

from __future__ import annotations

import importlib
import sys

_HIDDEN = "asammdf"
_USER = "can.io.mf4"


def hide_asammdf() -> None:
    """Let `import can` believe that asammdf is not installed."""
    if _USER not in sys.modules:
        sys.modules.setdefault(_HIDDEN, None)  # type: ignore[arg-type] # Python's own way to forbid an import


def bring_asammdf_back() -> None:
    """Undo `hide_asammdf`, also in python-can."""
    if _HIDDEN in sys.modules and sys.modules[_HIDDEN] is None:
        del sys.modules[_HIDDEN]
        if _USER in sys.modules:
            importlib.reload(sys.modules[_USER])
