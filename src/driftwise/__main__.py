"""`python -m driftwise` is `driftwise`."""

from driftwise.cli.cli import main

if __name__ == "__main__":
    main()
