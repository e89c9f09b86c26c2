"""Acceleration of an axle box: what repeats with the wheel's turn is the wheel's, all else is the rail's."""
