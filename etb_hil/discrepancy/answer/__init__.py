"""The answer of a search: errors, gains, detection limits, plots."""
