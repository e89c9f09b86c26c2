"""Trains from the channels of a track: axles, vehicles, and the forces of each wheel, without a model."""
