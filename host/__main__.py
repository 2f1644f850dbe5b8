"""`python -m host` is `bkd-host`."""

from host.cli import main

main()
