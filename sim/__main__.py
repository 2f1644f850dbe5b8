"""`python -m sim` is `bkd-sim`."""

from sim.cli import main

main()
