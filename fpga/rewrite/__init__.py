"""Verilog as Yosys writes it to Verilog for people: same behaviour, fewer and better names."""
