"""Meshes and their motion."""
