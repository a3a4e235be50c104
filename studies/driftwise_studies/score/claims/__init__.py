"""Claims held against the truth: plants that are drawn, written as files, and what the program says of them."""
