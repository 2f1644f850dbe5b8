"""Scenes of parts: what is still, what moves as a whole, what deforms."""
