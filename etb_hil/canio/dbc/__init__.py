"""What a DBC file and its roles make of frames.

The package holds layouts and protection, writes commands, and reads columns and samples.
"""
