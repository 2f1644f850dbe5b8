"""The way to another computer."""
