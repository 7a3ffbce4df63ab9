"""Run a scenario on a bench.

Bench files, what is refused before it moves, the runner, supervision, safe stop.
"""
