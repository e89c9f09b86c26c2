"""Cells of a map, marched together: what each march offers where many scenarios differ in a few fields."""
