"""The mathematics, arrays in and arrays out: it knows nothing of takes, files or terminals."""
