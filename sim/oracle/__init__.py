"""The oracle of the ray path: first hits in float64, sharing no code with machine and model."""
