"""What was recorded judged again: sessions, logs of any origin, one or many.

Exports, and logs sent onto a bus.
"""
