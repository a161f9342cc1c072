"""Real-time streams: frames in from a phone or another program, poses out at the source's rate."""
