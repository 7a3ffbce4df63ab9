"""The store of results of a bench or a lab, in SQLite or PostgreSQL."""
