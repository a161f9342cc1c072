"""Pictures: rendered faces and curves."""
