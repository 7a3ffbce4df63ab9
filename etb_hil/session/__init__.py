"""Sessions: the records of a run, and their analysis.

The package has the folder, its events, the analysis and comparisons.
"""
