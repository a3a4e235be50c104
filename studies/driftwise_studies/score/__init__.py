"""The scoreboard: the package on recordings, beside opponents. `driftwise score`."""
