"""Figures that need no file."""
