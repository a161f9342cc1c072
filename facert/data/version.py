"""The release of facert, which the files that it writes name."""

VERSION = "0.4.0"
MARK = "facert "
CREATED_BY = f"{MARK}{VERSION}"
