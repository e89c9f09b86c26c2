"""A wheel's fault, its size, and its force, from sensors along the track: a model is fitted to what they recorded.

Theory: docs/theory/gauges.rst.
"""
