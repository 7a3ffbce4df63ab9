"""The seed paper's own experiments: its set-ups run, drawn and put into numbers, and its properties checked."""
