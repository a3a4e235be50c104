"""Oracles: the mathematics written down plainly, sharing no code with the library."""
