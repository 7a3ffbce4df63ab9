"""What a run recorded, and what is concluded from it.

The package has the folder, its events, the analysis and comparisons.
"""
