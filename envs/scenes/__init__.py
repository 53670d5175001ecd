"""Scenes, one file a kind."""

HALF_SIDE = 10.0
"""Half the side of the cube that point robots move in, in the paper's units."""
