"""Small changes of the mathematics, each of which a test must notice."""
