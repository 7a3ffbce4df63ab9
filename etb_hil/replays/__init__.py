"""Replay: judge recorded sessions and logs of any origin again, one or many.

The package also has exports, and logs sent onto a bus.
"""
