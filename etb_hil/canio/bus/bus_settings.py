"""Which bus a bench is on, as its file says."""

from __future__ import annotations

from pydantic import Field, ValidationInfo, field_validator

from etb_hil.base.quantity import BitRate
from etb_hil.base.yamlfile import FileModel

VIRTUAL = "etb_virtual"
SOCKETCAN = "socketcan"


class BusSettings(FileModel):
    """Which bus: interface and channel as python-can names them, and bit rates.

    Further options are those of the interface.
    """

    interface: str = VIRTUAL
    channel: str = "bench"
    bitrate: BitRate = 500_000.0
    data_bitrate: BitRate = 2_000_000.0
    fd: bool = False
    options: dict[str, str | int | float | bool] = Field(default_factory=dict)

    @field_validator("bitrate", "data_bitrate")
    @classmethod
    def _is_a_rate_of_can(cls, rate: float) -> float:
        if not 1e3 <= rate <= 20e6 or rate != round(rate):
            raise ValueError("no bit rate of CAN; allowed: whole bits per second from 1 kbit/s to 20 Mbit/s")
        return rate

    @field_validator("options")
    @classmethod
    def _are_read_by_somebody(
        cls, options: dict[str, str | int | float | bool], info: ValidationInfo
    ) -> dict[str, str | int | float | bool]:
        if options and info.data.get("interface") in (VIRTUAL, SOCKETCAN):
            raise ValueError(f"{info.data['interface']} takes no further options; remove them")
        return options
