"""Numbers in Salut's order, as an estimator with several outputs wants them: by name."""

import numpy as np


def by_name(est, values):
    """A vector, or a matrix, in Salut's order as a dictionary; of one number for all nothing is made."""
    values, labels = np.asarray(values), np.empty(est.model.N, object)
    labels[est.model.salut] = [*est.state_names, *est.names]
    if values.ndim == 0:
        return float(values)
    if values.ndim == 1:
        return dict(zip(labels, values.tolist()))
    return {label: dict(zip(labels, row)) for label, row in zip(labels, values.tolist())}
