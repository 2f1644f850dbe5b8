"""The Verilog, simulated under cocotb."""
