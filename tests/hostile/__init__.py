"""What a hostile week tries, drawn from a seed: files, plots, saved files, series, signals, disks; see README.md."""
