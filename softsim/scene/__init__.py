"""Scenes: what the user writes, checked."""
