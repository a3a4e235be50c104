"""Whether a record can tell how fast each parameter drifts: from zero, from the noise, and from the others."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from .smoother import Hindsight

NOTICED = 1.353  # of the log-likelihood: 5 % for a variance that may be zero (half a chi2 on one degree of freedom)
VAGUE = 1.0  # deviation of a logarithm: known to a factor exp(2) either way
ENTANGLED = 0.95  # correlation of two logarithms
LEAST = 1e-6  # NVR at which the information about one that was not found is taken: its correlations do not depend on it


@dataclass(frozen=True)
class Separability:
    """How well a record tells the drift of each parameter and the variance of the noise apart.

    ``log_std`` are the standard deviations of log q_i (by name) and of log sigma^2 ("noise"), from Fisher's
    information at the fit; ``correlation`` (n + 1, n + 1) is that of the same logarithms, noise last; ``gain`` is what
    each q_i adds to the log-likelihood over none at all, the others learnt anew.
    """

    log_std: dict[str, float]
    correlation: np.ndarray
    gain: dict[str, float]

    @property
    def names(self) -> list[str]:
        """Names of the parameters."""
        return list(self.gain)

    @property
    def not_seen(self) -> list[str]:
        """Parameters whose drift the record cannot tell from none."""
        return [name for name, gain in self.gain.items() if gain < NOTICED]

    @property
    def entangled(self) -> list[tuple[str, str]]:
        """Pairs that the record cannot separate, the second "noise" where it is the variance of the noise."""
        names = [*self.names, "noise"]
        i, j = np.triu_indices(len(names), 1)
        return [(names[a], names[b]) for a, b in zip(i, j) if abs(self.correlation[a, b]) > ENTANGLED]

    @property
    def vague(self) -> list[str]:
        """Parameters that drift at a speed known to no better than a factor of seven, and the noise if it is such."""
        return [name for name, std in self.log_std.items() if std > VAGUE and name not in self.not_seen]

    @property
    def words(self) -> list[str]:
        """What cannot be told, a sentence each; empty where all can."""
        found: list[str] = []
        if self.not_seen:
            found.append(f"The record cannot tell a drift of {_list(self.not_seen)} from none.")
        for first, second in self.entangled:
            other = "the variance of the noise" if second == "noise" else f"that of {second}"
            found.append(
                f"It cannot separate the drift of {first} from {other}: more of one explains less of the other."
            )
        for name in self.vague:
            what = "The variance of the noise" if name == "noise" else f"How fast {name} drifts"
            found.append(f"{what} is known to a factor of {math.exp(2 * min(self.log_std[name], 5.0)):.0f} only.")
        return found


def separability(hindsight: Hindsight, names) -> Separability:
    """Return what a record can tell."""
    fit = hindsight.fit
    n, nvr = fit.likelihood.n, np.maximum(fit.nvr, LEAST)
    live, is_known = fit.likelihood.record.is_live, fit.likelihood.record.variance is not None
    at = [*np.flatnonzero(live), *([] if is_known else [n])]
    to_q = np.eye(n + 1)
    to_q[:n, n] = 1.0  # log q = log NVR + log sigma^2 - log ms
    scaled = fit.likelihood.information(nvr, fit.s2)[np.ix_(at, at)]
    size = np.sqrt(np.maximum(np.diag(scaled), 1e-300))
    inverse = np.linalg.pinv(scaled / np.outer(size, size), hermitian=True) / np.outer(size, size)
    C = np.full((n + 1, n + 1), np.nan)
    C[np.ix_(at, at)] = to_q[np.ix_(at, at)] @ inverse @ to_q[np.ix_(at, at)].T
    std = np.sqrt(np.diag(C))
    std[:n][~live] = np.inf
    std[n] = 0.0 if is_known else std[n]
    with np.errstate(invalid="ignore"):
        correlation = np.where(np.eye(n + 1) > 0, 1.0, C / np.outer(std, std))
    gain = {name: max(fit.loglik - _without(hindsight, i), 0.0) for i, name in enumerate(names)}
    return Separability(dict(zip([*names, "noise"], std.tolist())), np.nan_to_num(correlation), gain)


def _without(hindsight: Hindsight, i: int) -> float:
    """Return the log-likelihood where parameter i does not drift."""
    fit = hindsight.fit
    if fit.nvr[i] == 0:
        return fit.loglik
    return hindsight.learn(fit.likelihood, [np.maximum(fit.nvr, 1e-8)], (i,)).loglik


def _list(names) -> str:
    return names[0] if len(names) == 1 else f"{', '.join(names[:-1])} or {names[-1]}"
