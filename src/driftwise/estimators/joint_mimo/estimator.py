"""The joint filter of several outputs: state and parameters of a multivariable ARMAX system in canonical form."""

from __future__ import annotations

import math
from functools import cached_property
from typing import Any

import numpy as np

from ...detect.gate import InnovationGate, resolve_gate
from ...engine import ud, validation
from ...engine.errors import InputError
from ...memory.constant import Constant
from ...memory.settings import Setting, resolve_memory, resolve_watch, state_size
from ...models import noise as noises
from ...models.convert_mimo import ModelMIMO
from ...models.scale import InverseGamma, KnownScale, resolve_scale, sigma2
from ...models.structure import Structure, indices
from ..base import Estimator
from ..common.given_state import COUNT, COUNTS, SCORE
from ..common.memories import forgets_state, memory_of_joint, of_some, prior_of_parameters
from ..common.posterior import directions
from ..common.priors import covariance_of, mean_of
from ..common.settings import arguments, floor_of
from . import step as _step  # noqa: F401  (registers the step)
from .row import JOINT_MIMO, scratch_size
from .tables import prior_factors, tables


class JointMIMO(Estimator):
    """Posterior of state and parameters of a system with several outputs, sample by sample.

    The canonical form of structure indices nu_1..nu_p (each output has a state of its own, and equations that
    use the data of all; `driftwise.models.structure.Structure` writes it out):

        x^i+ = shift_up(x^i) - sum_j a_ij y_j + sum_l b_il u_l + w
        y_i = x^i[0] - sum_{j<i} a0_ij y_j + sum_l b0_il u_l + w_n,i

    Given data, it is linear in state and parameters, so the filter is the exact posterior when the noise is
    Gaussian with the stated covariances: theorem 3 of Salut et al. (1979), the outputs of a sample taken in order.
    Missing samples and held inputs: the first two moments of each product, exact for a Gaussian posterior.

    It runs **split** where no covariance links the outputs: one filter for each, the other outputs its data, each
    with its own learnt scale. Otherwise **coupled**: one filter of all unknowns, one common scale. A sample costs
    O(N^2), N the unknowns of each filter.

    Parameters
    ----------
    structure : (p,)
        Structure indices: the order nu_i of each output. One whole number for one output.
    inputs : int
        Number of inputs k.
    direct : bool
        Whether u(t) acts on y(t) at once (the terms b0).
    noise : EquationError, NoisePolynomial or NoiseCovariance
        ``EquationError(variance)`` with one variance or one per output; ``NoisePolynomial((d^1, .., d^p), variance)``;
        ``NoiseCovariance(Q (n, n), S (n, p), R (p, p))`` of the stacked system in Salut's order, n = sum nu_i. Without
        a variance, the scale is learnt (Student-t bands).
    memory : policy
        How the past of the parameters is forgotten, as in `Joint`: split, those of each output on their own; coupled,
        every measured output counts as a sample of the memory.
    gate : InnovationGate, optional
        Treat outliers of each output as missing.
    scale : InverseGamma, optional
        All variances relative to an unknown sigma^2 with this inverse-gamma prior (split: one for each output).
    s0, P0 : dictionary, and scalar or dictionary, optional
        Prior mean and covariance by name (``state_names`` and ``names``), such as ``{"a1.11": -0.8}`` and
        ``{"a1.11": 0.01}`` (a matrix as a dictionary of dictionaries). What is not named is as by default: wide, in the
        units of the scales. Of one output also (N,), and (N,) or (N, N), in Salut's order (`Structure`).
    y_scale, u_scale : float or (p,), float or (k,)
        Typical size of the data, for the default prior; `scaled_to` sets them.
    dt : float
        Seconds between samples.
    floor : float
        Relative round-off carried by y: R_t = R + (floor max|y recent|)^2.
    forget_state : bool
        Forget the state given the parameters as well, as in `Joint`.
    split : bool, optional
        None: split where noise and prior allow. False: coupled; with noise to be learnt, one scale for all outputs.

    Raises
    ------
    InputError
        Where a number does not fit; the message says which and why.

    Notes
    -----
    Bad at: white measurement noise (biased, as `Joint`; `OutputError` is refused), structure indices above the truth
    (nearly unidentifiable: see `information_ratio`), and split filters with many missing samples: what a gap makes two
    filters have in common is not carried from sample to sample
    (`tests/estimators/joint_mimo/test_joint_mimo_statistics.py` bounds what that costs).

    Examples
    --------
    >>> import driftwise as dw
    >>> truth = [-1.2, 0.5, -0.1, 1.0, 0.5, 0.2, -0.8, 0.3, 0.4]
    >>> y, u = dw.models.simulate_mimo((2, 1), truth, samples=400, inputs=1, noise_std=0.1, seed=1)
    >>> trace = dw.JointMIMO((2, 1), inputs=1).scan(y, u)
    >>> [f"{name} {value:.2f}" for name, value in zip(trace.names, trace.parameters[-1])][:3]
    ['a1.11 -1.19', 'a2.11 0.49', 'a2.12 -0.10']
    """

    link_words = "estimate them together with NoiseCovariance"  # what to do where innovations are correlated
    groups: list[list[int]]  # outputs that share a scale
    spent: np.ndarray  # (groups,) unknowns on which the reference prior of a learnt scale spends one half each

    def __init__(
        self,
        structure,
        inputs: int = 0,
        direct: bool = False,
        *,
        noise: Any = noises.EquationError(),
        memory: Any = Constant(),
        gate: InnovationGate | None = None,
        scale: InverseGamma | None = None,
        s0=None,
        P0=None,
        y_scale=1.0,
        u_scale=1.0,
        dt: float = 1.0,
        floor: float = 1e-12,
        forget_state: bool = False,
        split: bool | None = None,
    ):
        self.options = arguments(locals())
        inputs = validation.count("inputs", inputs)
        self.options["structure"] = nu = indices(structure, inputs)
        self.model = form = Structure(nu, inputs, bool(direct) and inputs > 0)
        self.outputs = form.outputs
        self._set_units(dt, y_scale, u_scale)
        self._units = form.units(self.y_scale, self.u_scale)

        Q, S, R = noises.covariances(noise, form, self.y_scale**2)
        self._set_prior(s0, P0)
        self.is_split = self._resolve_split(split, Q, S, R)
        p = form.outputs
        self.groups = [[i] for i in range(p)] if self.is_split else [list(range(p))]
        self._D0, self._U0 = prior_factors(self.prior_covariance, self._owner, self.groups)
        relative = scale is not None or getattr(noise, "variance", 0.0) is None
        self.scale = resolve_scale(scale, relative, 0)  # each output spends its own, below
        self._sizes = [sum(self.unknowns[i] for i in group) for group in self.groups]
        kernel_noise = noises.stacked(Q, S, R, form, self.groups)
        # the reference prior of a learnt scale spends one half on each unknown first
        spent = self._sizes if relative and scale is None else [0] * len(self.groups)
        self.spent = np.array(spent, float)
        longest = max(self.unknowns)
        detector, settle = resolve_watch(memory, longest)
        memories, fades, learns = self._memories(memory, kernel_noise)
        shape = tables(
            form,
            self.groups,
            kernel_noise,
            floor_of(floor),
            self.spent,
            self.prior_covariance,
            settle,
            detector.state_size(0),
            memories,
            fades=fades,
            learns=learns,
            forgets_state=forgets_state(forget_state, memories[0][0]),
        )
        # where samples fade the row keeps 2 alpha and 2 beta, and they fade with the memory
        kernel_scale = InverseGamma(0.0, 0.0) if fades and relative else self.scale
        self.policies = (shape, kernel_noise, memories[0][0], resolve_gate(gate, longest), kernel_scale, detector)
        self.scratch_size = scratch_size(shape, kernel_noise)
        self.dtype = JOINT_MIMO.dtype(shape)

    # --- settings ------------------------------------------------------------------------------------------

    @cached_property
    def unknowns(self) -> list[int]:
        """How many unknowns, states and parameters, the equation of each output has."""
        return [nu + size for nu, size in zip(self.model.nu, np.diff(self.model.theta_at).tolist())]

    @cached_property
    def _owner(self) -> np.ndarray:
        """Whose equation each unknown belongs to, (N,)."""
        return np.concatenate([np.repeat(np.arange(self.model.outputs), self.model.nu), self.model.targets])

    def _theta_units(self) -> np.ndarray:
        """Return the squared units of theta."""
        return self._units[self.model.n :]

    def _memories(self, memory, noise) -> tuple[list, float, float]:
        """Return memory and size of what it keeps of each group; whether samples fade, and whether it learns."""
        form, found, at = self.model, [], 0
        n, cap = form.n, np.diag(self.prior_covariance)
        resolve_memory(memory, Setting(self._units[n:], cap[n:], self.scale, first=n))  # whatever is wrong, in whole
        fades = learns = 0.0
        for g, group in enumerate(self.groups):
            states = sum(form.nu[i] for i in group)
            mine = np.flatnonzero(np.isin(self._owner, group))
            size, theta = len(mine), mine[states:]
            prior = self._s0[mine], self._U0[at : at + size * (size - 1) // 2], self._D0[mine]
            at += size * (size - 1) // 2
            scale = self.scale
            if isinstance(scale, InverseGamma):
                scale = InverseGamma(scale.alpha - self.spent[g] / 2, scale.beta)
            lags = form.lags[theta - n]
            setting = Setting(
                self._units[theta], cap[theta], scale, float(np.mean(noise.R[group])), len(theta),
                prior_of_parameters(*prior, states), states, (lags - lags.min()).astype(float),
                poles=states if form.outputs == 1 else 0, rows_stay=form.outputs == 1,
            )  # fmt: skip
            own, fades, learns = memory_of_joint(of_some(memory, theta - n, form.N - n), setting)
            found.append((own, state_size(own, len(theta))))
        return found, fades, learns

    def _set_prior(self, s0, P0):
        order, names = self.model.salut, [*self.model.state_names, *self.model.names]
        self._s0 = mean_of("s0", s0, order, names, several=self.model.outputs > 1)
        self.prior_covariance = covariance_of(P0, order, self._units, names, several=self.model.outputs > 1)

    def _resolve_split(self, split, Q, S, R) -> bool:
        form = self.model
        noise = np.block([[Q, S], [S.T, R]])
        outputs = np.arange(form.outputs)
        owner = np.concatenate([np.repeat(outputs, form.nu), outputs])
        free = noises.separates(noise, owner) and noises.separates(self.prior_covariance, self._owner)
        if split not in (None, False, True):
            raise InputError(f"split is None (where possible), True or False, got {split!r}")
        if split and not free:
            raise InputError(
                "split=True, but the noise or P0 links the outputs: separate filters would ignore it. Leave split out"
            )
        return free if split is None else bool(split)

    def smooth(self, *args, **options):
        """Refuse: there is no smoother of several outputs.

        The filter of output i of a split run on complete data is ``Joint(nu_i, inputs, direct)`` with the other outputs
        as inputs before u (their b are -a_ij; ``P0`` zero where the structure has no such lag): smooth that.
        """
        raise InputError(
            "JointMIMO has no smoother. On a complete record smooth one output after the other: Joint(nu_i, "
            "inputs=p - 1 + k).smooth(y[:, i], u_i), the columns of u_i being the other outputs, then u"
        )

    # --- reading a state -----------------------------------------------------------------------------------

    def mean(self, state) -> np.ndarray:
        """Return E s(t+1 | t) in Salut's order (`Structure`)."""
        s = np.concatenate([state["x"], state["theta"]], axis=-1)
        return s[..., self.model.kernel]

    def covariance(self, state) -> np.ndarray:
        """Return the covariance of s(t+1 | t) in Salut's order; relative to sigma^2 where that is unknown."""
        back = self.model.kernel
        return self._kernel_covariance(state)[..., back, :][..., back]

    def _kernel_covariance(self, state, times=None) -> np.ndarray:
        """Return the covariance in the kernel's order, each group's times a factor."""
        shape, full = self.policies[0], np.zeros((*np.shape(state), self.model.N, self.model.N))
        for g, group in enumerate(self.groups):
            mine = np.flatnonzero(np.isin(self._owner, group))
            U = state["U"][..., int(shape.U_at[g]) : int(shape.U_at[g + 1])]
            full[..., mine[:, None], mine] = ud.unpack(U, state["D"][..., mine]) * (1 if times is None else times[g])
        return full

    def model_of(self, state) -> ModelMIMO:
        """Return the model a state amounts to, with the covariance of its parameters."""
        n, s2 = self.model.n, self.sigma2(state)
        P = self._kernel_covariance(state, [s2[group[0]] for group in self.groups])
        return self.model_at(np.array(state["theta"]), P[n:, n:])

    def model_at(self, theta, P) -> ModelMIMO:
        """Return the model of a parameter vector and its covariance."""
        return ModelMIMO(self.model, theta, P, self.dt)

    @property
    def state_names(self) -> list[str]:
        """Names of the states: x{k}.{output}."""
        return self.model.state_names

    def degrees_of_freedom(self, is_used, observed) -> np.ndarray:
        """Return those of each prediction, (T, p), where so many outputs were used before; infinite: known scales."""
        if isinstance(self.scale, KnownScale):
            return np.full(is_used.shape, np.inf)
        found = np.empty(is_used.shape)
        for g, group in enumerate(self.groups):
            mine = is_used[:, group]
            before = np.cumsum(mine).reshape(mine.shape) - mine + observed[group].sum()
            found[:, group] = self.scale.alpha + (before - self.spent[g]) / 2
        return 2 * np.maximum(found, 0.5)

    @property
    def _fades(self) -> bool:
        """Whether the memory says how many samples count."""
        return self.policies[0].fades > 0

    def start(self, series: int | None = None) -> np.ndarray:
        """Return a fresh state, or ``series`` of them."""
        state = super().start(series)
        if self._fades and not isinstance(self.scale, KnownScale):
            state["counts"][..., COUNT::COUNTS] = 2 * self.scale.alpha - self.spent
            state["chi2"] = 2 * self.scale.beta
        return state

    def _counts(self, state):
        """Return (count, chi2, logdet, spent) of each group."""
        observed, spent = np.asarray(state["observed"]), self.spent
        for g, group in enumerate(self.groups):
            yield float(observed[group].sum()), float(state["chi2"][g]), float(state["logdet"][g]), float(spent[g])

    def sigma2(self, state) -> np.ndarray:
        """Return the estimate of the scale sigma^2 of each output, (p,); 1 where the noise is known."""
        found = [sigma2(self.scale, count - spent, chi2) for count, chi2, _, spent in self._counts(state)]
        if self._fades and not isinstance(self.scale, KnownScale):
            left, chi2 = np.asarray(state["counts"])[COUNT::COUNTS], np.asarray(state["chi2"])
            found = np.where(left >= 1, chi2 / np.maximum(left, 1), np.maximum(chi2, 1.0)).tolist()
        return np.repeat(found, [len(group) for group in self.groups])

    def scale_posterior(self, state) -> tuple[np.ndarray, np.ndarray]:
        """Return (alpha, beta), (p,) each, of the inverse-gamma posterior of sigma^2; infinite where it is known."""
        p, lengths = self.model.outputs, [len(group) for group in self.groups]
        if isinstance(self.scale, KnownScale):
            return np.full(p, np.inf), np.full(p, np.inf)
        alpha = [self.scale.alpha + (count - spent) / 2 for count, _, _, spent in self._counts(state)]
        beta = [self.scale.beta + chi2 / 2 for _, chi2, _, _ in self._counts(state)]
        if self._fades:
            alpha, beta = state["counts"][COUNT::COUNTS] / 2, state["chi2"] / 2
        return np.repeat(alpha, lengths), np.repeat(beta, lengths)

    def noise_covariance(self, state) -> np.ndarray:
        """Return the covariance of w_n that the filters assume, times their scales, (p, p)."""
        noise, std = self.policies[1], np.sqrt(self.sigma2(state))
        W = noise.W.reshape(len(std), -1)
        return (W * noise.R) @ W.T * std * std[:, None]

    def loglik(self, state) -> float:
        """Return log p(y_1..y_t), parameters (and scales) integrated out: the evidence, ready to compare.

        Under the reference prior of an unknown scale it is known up to a constant only, which depends on the structure:
        compare structures with a proper `InverseGamma(alpha, beta)`.
        """
        if self._fades:
            return float(state["counts"][SCORE::COUNTS].sum())
        total = 0.0
        for count, chi2, logdet, spent in self._counts(state):
            total -= 0.5 * (count * math.log(2 * math.pi) + logdet)
            if isinstance(self.scale, KnownScale):
                total -= 0.5 * chi2
                continue
            prior, beta = self.scale.alpha - spent / 2, self.scale.beta
            alpha = prior + count / 2
            if alpha <= 0:
                return math.nan
            total += math.lgamma(alpha) - alpha * math.log(beta + chi2 / 2)
            total -= math.lgamma(prior) - prior * math.log(beta) if prior > 0 else 0.0
        return total

    def information_ratio(self, state) -> list[tuple[float, np.ndarray]]:
        """Return (ratio, direction) pairs: posterior over prior variance along directions of theta, worst first.

        A ratio near one says that the data have taught nothing about that combination of parameters (above 0.5
        counts as unlearnt). Directions are unit vectors in prior deviations.
        """
        n = self.model.n
        return directions(self._kernel_covariance(state)[n:, n:], np.diag(self.prior_covariance)[n:])
