"""The hardware: update processor and memory parts in Amaranth."""
