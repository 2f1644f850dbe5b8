"""The golden model: bit-exact, file for file as hdl."""
