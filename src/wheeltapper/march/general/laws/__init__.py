"""Contact laws of the general march: one law, one file; `switch.py` calls them by their numbers."""
