"""Objects that move, from radar plots and position reports."""

from ..engine.lazy import lazily

_HOME = {
    "Tracker": "tracker",
    "Tracks": "tracks",
    "TrackTrace": ".estimators.track.trace",
    "Manoeuvre": ".estimators.manoeuvre.estimator",
    "track": "tracker",
    "TrackEstimator": ".estimators.track.estimator",
    "read_plots": "read",
}

__all__ = list(_HOME)
__getattr__, __dir__ = lazily(__name__, _HOME)
