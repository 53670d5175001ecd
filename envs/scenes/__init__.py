"""Scenes, one file a kind."""
