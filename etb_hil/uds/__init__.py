"""Read what a unit's own diagnostics report: UDS (ISO 14229-1) over ISO-TP.

The bench asks, the controller answers.
"""
