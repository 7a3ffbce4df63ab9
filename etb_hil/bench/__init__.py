"""Bench and scenario files, the sequence runner, its safe stop, sessions."""
