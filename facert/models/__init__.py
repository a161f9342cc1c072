"""The mathematics, arrays in and arrays out: without takes, files or terminals."""
