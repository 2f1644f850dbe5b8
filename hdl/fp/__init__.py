"""Float formats and the operations on them, one a file."""
