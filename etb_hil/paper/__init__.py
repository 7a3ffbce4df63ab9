"""The seed paper's own experiments, run, drawn and put into numbers.

Its properties are checked, too.
"""
