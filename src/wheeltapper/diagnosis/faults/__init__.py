"""The faults of a wheelset: one fault, one file; the catalogue finds them by itself."""
