"""Verilog, boards, resources and timing."""
