"""``python -m mrfit.cli``."""

from mrfit.cli.main import main

if __name__ == "__main__":
    main()
