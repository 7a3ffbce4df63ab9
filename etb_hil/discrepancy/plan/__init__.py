"""Plans for isolation: scenarios, other records, bench measurements."""
