"""The store of results: finished runs of one bench or of a whole lab, in SQLite or PostgreSQL."""
