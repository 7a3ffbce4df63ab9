"""What a run recorded, and what is concluded from it.

The folder, its events, the judging, comparisons.
"""
