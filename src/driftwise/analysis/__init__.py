"""Questions to a record: which model, which order, what changed, how sure."""

from ..engine.lazy import lazily

_HOME = {
    "Comparison": "comparison",
    "OrderEvidence": "orders",
    "choose_order": "orders",
    "StructureEvidence": "structures",
    "choose_structure": "structures",
    "identifiability": "identifiable",
    "Identification": "identification",
    "advise_window": "advisor",
    "find_frequency": "lines",
    "calibration": "forecast_verdicts",
    "compare": "comparison",
    "check_estimator": "laws",
    "check_policy": "laws",
    "sample_data": "sample",
}

__all__ = list(_HOME)
__getattr__, __dir__ = lazily(__name__, _HOME)
