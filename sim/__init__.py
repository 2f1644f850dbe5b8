"""What surrounds the hardware: scenes, trees, compiler, golden model and simulation."""
