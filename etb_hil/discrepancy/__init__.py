"""Discrepancy analysis: what a model lacks, which cause explains it, and by how much."""
