"""`python -m driftwise` is `driftwise`."""

from driftwise.edge.cli import main

if __name__ == "__main__":
    main()
