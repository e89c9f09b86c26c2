"""Recordings: what a sensor gives over time, read from files and written."""
