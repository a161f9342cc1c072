"""The motion of a source in time, by which noise is removed and gaps are filled."""
