"""The outside world: tables in, figures, reports and a command line out."""
