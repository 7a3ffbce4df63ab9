"""The operator page: a local web server in a process of its own, and what a run tells it."""
