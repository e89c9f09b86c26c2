"""Lowered scenarios: a program with its units, and how its march is read; one file for each march."""
