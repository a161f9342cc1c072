"""Regions of the face that are learned apart: what they are, and how to find them."""
