"""``python -m bridgegen``: the command line."""

from bridgegen.cli import main

main()
