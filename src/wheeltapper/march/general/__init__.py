"""The general march: any linear structure given as modes, any number of contacts."""
