"""``python -m dh2sim``."""

from dh2sim.cli.main import main

if __name__ == "__main__":
    main()
