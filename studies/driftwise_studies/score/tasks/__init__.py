"""Tasks on single recordings: what somebody would want of it, each a function of the folder that returns verdicts."""
