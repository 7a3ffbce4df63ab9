"""What was recorded judged again: sessions, logs of any origin, one or many.

The package also has exports, and logs sent onto a bus.
"""
