"""What a unit's own diagnostics report: UDS (ISO 14229-1) over ISO-TP, as the bench asks and the controller answers."""
