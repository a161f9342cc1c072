"""Tables of columns over time, in CSV and JSON: what trackers write, and facert."""
