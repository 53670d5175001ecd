"""Exact and batched collision checking."""
