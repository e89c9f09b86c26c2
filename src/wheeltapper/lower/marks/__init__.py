"""Marks that wheels leave on rails, and rails that remember them."""
