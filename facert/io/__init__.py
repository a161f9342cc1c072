"""One file per format; every read of a foreign file goes through one guarded door."""
