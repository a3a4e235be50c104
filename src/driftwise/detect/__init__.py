"""Has something changed? Detectors of jumps, and the gate."""

from ..engine.lazy import lazily

_HOME = {
    "GainProbes": "gain",
    "PullTest": "gain",
    "ScoreCUSUM": "score",
    "PageHinkley": "hinkley",
    "VarianceCUSUM": "variance",
    "GLR": "glr",
    "SelfStarting": "self_starting",
    "ProbeBank": "probes",
    "probe_bank": "probes",
    "score_test": "score_statistic",
    "Alarms": "alarms",
    "Monitor": "monitor",
    "Parity": "parity",
    "design_restart": "restart",
    "run_length": "average_run_length",
    "threshold_for": "average_run_length",
    "brownian_run_length": "brownian",
    "brownian_threshold": "brownian",
    "InnovationGate": "gate",
    # for a detector of one's own
    "register": "registry",
}

__all__ = list(_HOME)
__getattr__, __dir__ = lazily(__name__, _HOME)
