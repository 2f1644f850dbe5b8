"""The update processor: one instruction stream in, all node bounds out."""
