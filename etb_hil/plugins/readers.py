"""Declaration of a log reader; `READER = Reader(...)`."""

from etb_hil.canio.frames import FrameBlock as FrameBlock
from etb_hil.canio.frames import FrameFlag as FrameFlag
from etb_hil.canio.logs.log_reader import LogReader as LogReader
from etb_hil.canio.logs.log_reader import Reader as Reader

__all__ = ["FrameBlock", "FrameFlag", "LogReader", "Reader"]
