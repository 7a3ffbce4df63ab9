"""Hardware-in-the-loop bench for electronic throttle bodies over CAN.

What is public stands in `__init__.pyi`; each name is loaded when it is first used.
"""

import lazy_loader

__version__ = "0.1.0"

__getattr__, _names, __all__ = lazy_loader.attach_stub(__name__, __file__)


def __dir__() -> list[str]:
    return [*_names(), "__version__"]
