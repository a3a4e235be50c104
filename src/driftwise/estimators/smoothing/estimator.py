"""What an estimator of drifting parameters offers once the record is complete: `smooth` and `tune`."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

from ...engine import validation
from ...memory.drift import Drift
from .smoother import look_back, transition


class InHindsight:
    """`smooth` and `tune`, for models y = psi' theta + e whose regressors are data."""

    model: Any
    options: dict[str, Any]
    scaled_to: Callable[..., Any]

    def smooth(
        self, y, u=None, *, drift="auto", hyper: Any = "ml", jumps: Any = "detect", lag=None, shared=False, time=None
    ):
        """Return the parameters at every sample given the whole record, their drift learnt from it.

        The parameters take random walks (or integrated ones: straight lines that bend), each at its own speed, which
        is found by maximum likelihood; jumps are found by the smoother and left free. The memory of the estimator does
        not matter, but for its ``phi``, and outliers that its gate rejects, or `AutoMemory` finds, count as missing. No
        imputation: a sample with a missing number in it, or among its regressors, teaches nothing.

        Parameters
        ----------
        y, u : as for `scan`
        drift : "auto", "walk" or "integrated"; "auto" takes the more likely one
        hyper : "ml", the most likely drift, taken for known; "average" over the drifts the record leaves open, for bars
            that hold even where it cannot tell; or the noise-to-variance ratio q mean(psi_i^2)/sigma^2 of each
            parameter (one number for all)
        jumps : "detect", None, or samples at which the parameters are new
        lag : samples to look ahead, instead of to the end of the record; drift and jumps are those of all of it
        shared : bool, one ratio for all parameters
        time : (T,) instants in seconds; multiples of dt if omitted

        Returns
        -------
        SmoothedParameters

        Notes
        -----
        Bad at: streams (use `scan`), coloured noise and noise on the input, records that hardly excite the model, and a
        noise variance that changes. Abid and Kamoun (2008); Young (2011).

        Examples
        --------
        >>> import numpy as np, driftwise as dw
        >>> rng = np.random.default_rng(0)
        >>> phi = rng.standard_normal((400, 2))
        >>> theta = np.column_stack([np.cumsum(0.05 * rng.standard_normal(400)), np.where(np.arange(400) < 150, 1, 3)])
        >>> y = (phi * theta).sum(axis=1) + 0.2 * rng.standard_normal(400)
        >>> print(dw.Regression(["slope", "gain"]).smooth(y, phi).words)
        In hindsight (400 samples), the parameters take a random walk, of which the log-likelihood is 38.6 higher than
        of an integrated random walk. Memory in samples: slope 3.7, gain 85. The noise has standard deviation 0.199.
        Jumps: gain jumped by +1.98 (±0.032) at sample 150; odds beyond a million to one. The record cannot tell a drift
        of gain from none. The bars take the drift for known all the same; those of hyper='average' do not.
        """
        from .smoothed_parameters import SmoothedParameters

        found = look_back(self, y, u, drift, hyper, jumps, lag, shared)
        y, u = validation.record(y, u, self.model.inputs)
        return SmoothedParameters(self, y, u, found, lag, time)

    def tune(self, y, u=None, *, shared=False):
        """Return the same estimator with what a record says of drift and noise as numbers: ``Drift`` and ``variance``.

        Maximum likelihood for random walks (or what the ``phi`` of the memory says), without a look at jumps; it then
        runs sample by sample like any other, at the cost of a Kalman filter. Default priors and the units of q are
        those of `scaled_to`.

        Parameters
        ----------
        y, u : as for `scan`
        shared : bool, one noise-to-variance ratio for all parameters

        Notes
        -----
        Bad at: a history unlike what is to come. A parameter that did not drift in the record will not be followed.

        Examples
        --------
        >>> import numpy as np, driftwise as dw
        >>> rng = np.random.default_rng(0)
        >>> level = np.cumsum(0.1 * rng.standard_normal(2000))
        >>> est = dw.Regression(["level"]).tune(level + rng.standard_normal(2000), np.ones(2000))
        >>> print(f"{est.options['variance']:.2f} {est.options['memory'].q[0] * est.y_scale**2:.4f}")
        0.98 0.0110
        """
        found = look_back(self, y, u, drift="walk", jumps=None, shared=shared)
        scaled = self.scaled_to(y, u)
        fit = found.fit
        q = fit.nvr * fit.s2 * fit.likelihood.unit / scaled._theta_units()
        memory = Drift(transition(self).tolist(), q.tolist())
        return type(scaled)(**{**scaled.options, "memory": memory, "variance": float(fit.s2), "scale": None})
