"""The position laws that a bench file can name, one file each.

`registry` finds them.
"""
