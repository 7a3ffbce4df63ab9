"""Candidates: effects and parameters that are tested and fitted, and their collinearity."""
