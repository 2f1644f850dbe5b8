"""B-KD trees in float64: construction and cost."""
