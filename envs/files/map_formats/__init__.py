"""Formats of occupancy grids: a module a format, each of which reads a file into `Cells`."""
