"""Analysis of data too slow for balances: whole runs fitted in free run."""
