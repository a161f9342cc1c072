"""Experiments: what the README's figures were measured with. Run them as modules."""
