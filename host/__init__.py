"""The tool for who has a board on a serial port."""
