"""Data sets: labelled passages of any vehicle over any track, as sensors record them."""
