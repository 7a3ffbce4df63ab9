"""The typed record of a run: measurements, verdict, bench, bus; its JSON file; how values are shown."""
