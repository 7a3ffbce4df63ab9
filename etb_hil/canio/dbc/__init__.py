"""Decode and encode frames by a DBC file and its roles.

The package holds layouts and protection, writes commands, and reads columns and samples.
"""
