"""Exact vibro-impacts of railway wheels on irregular rails, and the faults that they reveal."""
