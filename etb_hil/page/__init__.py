"""The operator page: a local web server, and what a run tells it.

The server is a process of its own.
"""
