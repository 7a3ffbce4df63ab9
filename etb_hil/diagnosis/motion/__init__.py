"""Motion in single phases: steps, returns, slow passes and rests.

They are read from the samples of their segments.
"""
