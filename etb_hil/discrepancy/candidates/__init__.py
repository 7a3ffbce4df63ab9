"""Candidates: effects and parameters that are tested, and their collinearity."""
