"""Numbers of an earlier study of the same experiment, other code: what rows of the comparison are judged against.

A word for each number, as many digits as are known; - is not known. ``LISTED``: RMSE of x1, x2, x3 from 0.15 s and from
2 s on, settling time of x3 (200 records). ``LISTED_ERRORS``: RMSE of x2, x3 under model errors (100 records).
"""

from __future__ import annotations

from .opponents import HONEST, IGNORING, STEADY, TIGHT, TRUSTING, WALKING

THIS = "this package's comparison of observers"
THEOREM, THEOREM4 = "theorem, N = 6 (the paper)", "theorem, constant disturbance only, N = 4"
GROWING6, GROWING4 = "growing least squares, 6 modes", "growing least squares, 4 modes"
WINDOW6, WINDOW4_SHORT, WINDOW4 = "window, 6 modes, 1 s", "window, 4 modes, 0.5 s", "window, 4 modes, 1 s"
SOFT = "window, 6 modes, soft prior 2, {} s"

LISTED = {
    THEOREM: ("8.9e-4 0.043 10.1", "5.7e-4 0.0156 3.90", "never"),
    THEOREM4: ("6.1e-4 0.0115 1.07", "3.9e-4 6.2e-4 0.071", "0.42"),
    GROWING6: ("6.5e-4 0.027 6.2", "3.9e-4 8.7e-3 2.18", "10"),
    GROWING4: ("5.7e-4 0.011 1.04", "3.5e-4 5.3e-4 0.069", "0.40"),
    WINDOW6: ("9.8e-4 0.021 4.8", "9.8e-4 0.021 4.8", "never"),
    WINDOW4_SHORT: ("1.4e-3 0.018 0.53", "1.4e-3 0.018 0.53", "-"),
    WINDOW4: ("9e-4 5e-3 0.090", "9e-4 5e-3 0.090", "1.0"),
    SOFT.format(0.3): ("- - 0.46", "- - 0.46", "-"),
    SOFT.format(0.5): ("- - 0.42", "- - 0.42", "-"),
    SOFT.format(1): ("- - 0.090", "- - 0.090", "-"),
    SOFT.format(2): ("- - 0.070", "- - 0.070", "-"),
    HONEST: ("5.2e-4 4.5e-3 0.145", "3.5e-4 5.3e-4 0.072", "0.17"),
    TIGHT: ("8.7e-3 0.026 0.22", "7.7e-3 0.016 0.090", "0.14"),
    TRUSTING: ("5.6e-4 8.1e-3 1.0", "3.6e-4 3.9e-3 0.96", "9.8"),
    IGNORING: ("0.35 0.22 0.34", "0.39 0.24 0.29", "0.16"),
    STEADY: ("0.045 0.65 9.6", "9.5e-4 6.7e-3 0.31", "1.7"),
    "Luenberger, 4 states, poles from -8": ("0.015 0.33 5.6", "1.2e-3 0.011 0.18", "1.0"),
    "Luenberger, 4 states, poles from -4": ("0.039 0.46 2.4", "1.1e-3 6e-3 0.12", "1.8"),
    "Luenberger, 6 states, poles from -2": ("17 - 2e5", "5 - 6e4", "never"),
    "Luenberger, 6 states, poles from -8": ("0.14 - 1e3", "2e-3 - 25", "never"),
    "Savitzky-Golay, 501 points, degree 3": ("2e-3 0.027 1.3", "2e-3 0.027 1.3", "10"),
    # x1, x2 of the degree 4 are sigma sqrt(25/1001) and the like: the earlier study's 1.5e-3 and 0.020 were SciPy's
    # savgol_coeffs, which loses its digits at this length
    "Savitzky-Golay, 1001 points, degree 4": ("1.37e-3 0.0193 0.82", "1.37e-3 0.0193 0.82", "10"),
    "Savitzky-Golay, centred (offline), 1001 points, degree 4": ("5e-4 2.4e-3 0.147", "5e-4 2.4e-3 0.147", "-"),
}

_COLUMNS = (THEOREM, HONEST, WINDOW4_SHORT, WINDOW4, WALKING)
_SAME = ("0.018 0.53", "5e-3 0.09", "0.019 0.69")  # windows with 4 modes do not know the cosine


def _row(*words: str) -> dict[str, str]:
    return dict(zip(_COLUMNS, words, strict=True))


LISTED_ERRORS = {
    "nominal": _row("0.015 3.8", "5e-4 0.07", *_SAME),
    "told w = 52, true 50": _row("0.0155 4.0", "5e-4 0.07", *_SAME),
    "the same with q2 = 50": _row("0.020 5.0", "0.014 3.5", "0.024 3.5", "0.015 3.5", "0.024 3.6"),
    "told R 10 % too large": _row("0.54 5.0", "0.45 1.8", "0.018 0.56", "0.021 0.63", "0.018 0.67"),
    "told R 10 % too small": _row("0.63 5.7", "0.54 2.1", "0.019 0.63", "0.024 0.73", "0.019 0.76"),
    "R drifts 1 -> 1.3": _row("0.88 6.1", "0.72 2.6", "0.019 0.68", "0.034 1.05", "0.019 0.75"),
    "R jumps 1 -> 1.5 at 5 s": _row("1.8 9.5", "1.4 5.0", "0.022 1.08", "0.079 2.4", "0.021 0.96"),
    "noise AR(1), pole 0.99": {THEOREM: "- 10.7", WINDOW4: "- 0.58", HONEST: "- 0.088"},
    "50 Hz interference, no noise": {THEOREM: "- 1.13", WINDOW4: "- 0.078", HONEST: "- 0.068"},
}
