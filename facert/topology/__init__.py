"""The framework of Zhang et al. (2017): key frames to performances, points to faces."""
