"""Irregularities of rail and wheel, one law in each file."""
