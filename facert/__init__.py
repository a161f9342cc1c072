"""facert: carry a facial performance over to any character's rig, from a handful of poses."""

__version__ = "0.1.0"
