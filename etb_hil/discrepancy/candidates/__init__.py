"""Candidates: effects and parameters that are tested."""
