"""Markers as captures really are: head motion, bad markers, gaps and noise."""
