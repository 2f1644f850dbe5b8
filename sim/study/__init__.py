"""Experiments: many machines, scenes and rays, and what comes of them."""
