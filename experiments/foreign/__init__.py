"""Files that other programs and libraries write, read by facert, and facert's read by them."""
