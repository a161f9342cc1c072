"""Training of a retargeter on a take, and retargeting of performances to a character."""
