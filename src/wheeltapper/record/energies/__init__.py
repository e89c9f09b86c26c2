"""Energy of a run, by shares, and what is missing of it."""
