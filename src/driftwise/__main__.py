"""`python -m driftwise` is `driftwise`."""

from driftwise.cli.entry import main

if __name__ == "__main__":
    main()
