"""Optimisers, and the bridge between named tensors and flat vectors."""
