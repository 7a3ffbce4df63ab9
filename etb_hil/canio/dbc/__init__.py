"""What a DBC file and its roles make of frames.

Layouts, protection, commands out, columns and samples in.
"""
