"""Gaussian processes: kernel, exact likelihood with its closed-form gradient."""
