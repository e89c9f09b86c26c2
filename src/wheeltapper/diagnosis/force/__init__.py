"""The contact force behind the acceleration of a deck."""
