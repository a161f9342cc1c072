"""Posing a character: the most probable whole pose given a few of its controls."""
