"""Paths of a wheel over a rail, as pieces of polynomials."""
