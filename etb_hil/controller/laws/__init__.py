"""Position laws.

Each is a file of `kinds` with its gains' design and its compiled torque.
"""
