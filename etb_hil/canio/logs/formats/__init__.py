"""The log formats that are read, one file each.

`reading` finds them by their suffixes.
"""
