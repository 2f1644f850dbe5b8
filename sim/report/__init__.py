"""What a run showed: figures, mismatches and tables."""
