"""Runs a scenario on a bench: bench files, what is refused before it moves, the runner, supervision, safe stop."""
