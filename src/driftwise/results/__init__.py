"""What a run said: traces, summaries, events, verdicts."""

from ..engine.lazy import lazily

_HOME = {
    "Diagnosis": "verdicts",
    "Verdict": "verdicts",
    "Summary": "summary",
    "SummaryMIMO": "output_summary",
    "ljung_box": "whiteness",
    "nis": "whiteness",
    "Trace": "trace",
    "ObserverTrace": "observer_trace",
    "ParameterTrace": "parameter_trace",
    "save_state": "snapshot",
    "load_state": "snapshot",
}

__all__ = list(_HOME)
__getattr__, __dir__ = lazily(__name__, _HOME)
