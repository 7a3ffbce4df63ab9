"""Explain a record by hypotheses, compared by the likelihood of the data."""
