"""From a take to a trained retargeter, and from a performance to the poses of a character."""
