"""Which frames of a take to pose: those that all others are near to."""
