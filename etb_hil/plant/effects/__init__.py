"""Effects beyond the base model, one a file, and their ports.

At a port, effects enter the equations.
"""
