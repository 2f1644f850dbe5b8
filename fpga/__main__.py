"""`python -m fpga` is `bkd-fpga`."""

from fpga.cli import main

main()
