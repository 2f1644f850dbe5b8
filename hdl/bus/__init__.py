"""What the machine speaks to the rest of a chip: AXI4 to memory, registers to a processor."""
