"""Measurements of what hostile files, kills and long runs do; slow, so outside of the tests."""
