"""The measurements, one file each.

A file has the declaration `MEASUREMENT` and the function that computes the value.
"""
