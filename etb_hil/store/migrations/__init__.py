"""Migrations of a store's tables from each version to the next."""
