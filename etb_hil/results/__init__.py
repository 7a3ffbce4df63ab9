"""The typed record of a run: measurements, verdict, bench, bus; its JSON file.

How values are shown.
"""
