"""Explain a record by hypotheses of one family, compared by the likelihood of what was measured."""
