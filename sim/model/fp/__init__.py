"""Model of hdl.fp: floats are bit patterns in int64 arrays."""
