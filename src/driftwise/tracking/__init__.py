"""Radar plots in, tracks out: readers, frames, trackers, and what tracks are written as."""
