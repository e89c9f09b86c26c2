"""Inference: a recording against a family of models, the fits, and what a passage tells of its fields."""
