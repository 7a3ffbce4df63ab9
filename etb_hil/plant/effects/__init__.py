"""What the base model leaves out: one effect a file, and their ports.

At a port, effects enter the equations.
"""
