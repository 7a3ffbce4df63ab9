"""What many runs say together: temperature taken out, control charts, capability, gauge R&R, drift."""
