"""Shared parts of commands: options and their help, files, batches, the console, progress.

`conversion`, `live_status` and `pose_view` are the parts of `convert`, `live` and `pose` that need
NumPy or rich at import: they are loaded when such a command runs, not for its help.
"""
