"""Planners that are compiled themselves, and ask nothing in Python while they search."""
