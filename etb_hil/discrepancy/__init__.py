"""Discrepancy analysis: what a model lacks, which cause explains it, and how well."""
