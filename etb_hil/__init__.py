"""Hardware-in-the-loop bench for electronic throttle bodies over CAN."""

__version__ = "0.1.0"
