"""Tree to memory image and instruction stream."""
