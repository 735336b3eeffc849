"""``python -m mrfit.cli``."""

from mrfit.cli.main import main

main()
