"""What holds to the last digits: huge priors, scaled data, the likelihood, least squares, the number of operations."""

from __future__ import annotations

import numpy as np
from scipy.signal import lfilter

import driftwise as dw

from . import counting, printed
from .records import PRINTED, TRUE_D, canonical, coloured
from .verdict import Section, Table, Verdict, short

SOURCE = "Salut 1979, theorem 3, (20); docs/decisions/ud.md"


def section(seeds: int) -> Section:
    """Check the engine against arithmetic of another kind; nothing here depends on ``seeds``."""
    orders = range(1, 7)
    rows = [
        [
            str(n),
            str(counting.per_sample(n)),
            str(counting.arx(n)),
            str(counting.dense(n)),
            f"{counting.arx(n) / counting.dense(n):.3f}",
        ]
        for n in orders
    ]
    head = ["order n", "counted, all of it", "22 n² + 36 n + 8", "dense textbook", "ratio of the two"]
    return Section(
        "What holds to the last digits",
        [
            "The engine keeps P = U D U'. These checks compare it with arithmetic that shares no code with it: "
            "equation (20) in 60 decimal digits, one least squares over all the data, an integral over the unknown "
            "parameter, and numbers that count.",
        ],
        [
            Table(
                "Additions, multiplications and divisions per sample (one input, direct term, N = 3 n + 1)", head, rows
            )
        ],
        [],
        [huge_prior(), scaling(), likelihood(), batch(), operations()],
    )


def _second_order(T, seed):
    """Return y and u of a plant of order 2 with a direct term, equation error of variance .09."""
    rng = np.random.default_rng(seed)
    u = rng.standard_normal((1, T))
    noise = np.zeros((1, T, 2)), 0.3 * rng.standard_normal((1, T))
    y, _ = canonical(np.array([0.7, -1.5]), *noise, b=np.array([0.5, 1.0]), u=u, direct=0.2)
    return y[0], u[0]


def huge_prior() -> Verdict:
    """P0 = 1e16 I against 60 digits: the printed recursion breaks down, factors do not."""
    y, u = _second_order(200, 1)
    s, P0, R = np.zeros(7), 1e16 * np.eye(7), 0.09
    exact, _, _ = printed.run_long(2, y, R, s, P0, u)
    est = dw.Joint(2, 1, True, noise=dw.models.EquationError(R), P0=P0)
    trace = est.scan(y, u, keep="covariance")
    error = np.abs(est.mean(trace.state) - exact)[2:].max()
    eigenvalues = np.linalg.eigvalsh(trace.covariance)
    with np.errstate(all="ignore"):
        T = np.array(printed.run(2, y, R, s, P0, u)[2])
    broken = np.flatnonzero(~(T > 0))
    fails = f"T ≤ 0 at step {broken[0]}" if broken.size else "survives"
    good = error <= 1e-12 and trace.variance.min() > 0 and np.all(eigenvalues[:, 0] >= -1e-14 * eigenvalues[:, -1])
    return Verdict(
        "prior P0 = 1e16 I, order 2 with input, 200 samples",
        f"error {short(error)}; the printed (20): {fails}",
        "error ≤ 1e-12 against 60 digits, T > 0, P ≥ 0",
        bool(good),
        SOURCE,
    )


def scaling() -> Verdict:
    """Data times 2^30 give the same answer times 2^30, bit for bit, missing samples and walking parameters included."""
    y, u = _second_order(200, 2)
    y[[5, 60, 61]] = np.nan
    unit = np.array([1, 1, 0, 0, 1, 1, 1.0])  # x and b carry the unit of y, a does not

    def run(c):
        units = c**unit
        est = dw.Joint(
            2,
            1,
            True,
            noise=dw.models.EquationError(0.09 * c**2),
            P0=5 * units**2,
            memory=dw.RandomWalk(1e-6 * units[2:] ** 2),
        )
        trace = est.scan(c * y, u)
        covariance = est.covariance(trace.state) / np.outer(units, units)
        return est.mean(trace.state) / units, covariance, trace.prediction / c, trace.variance / c**2

    same = all(np.array_equal(a, b, equal_nan=True) for a, b in zip(run(1.0), run(2.0**30)))
    return Verdict(
        "y times 2^30", "every bit the same" if same else "bits differ", "bit-identical after unscaling", same, SOURCE
    )


def likelihood() -> Verdict:
    """Order 1: the product of the innovations' densities equals the integral over a of ordinary Kalman likelihoods."""
    y, d, R = np.array([0.4, -0.3, 0.9, 0.2]), 0.3, 0.5
    (x0, a0), (Px, Pa) = (0.1, -0.2), (0.7, 0.6)
    nodes, weights = np.polynomial.hermite_e.hermegauss(120)
    a = a0 + np.sqrt(Pa) * nodes
    x, P, log = np.full(a.size, x0), Px, np.zeros(a.size)
    for y_t in y:
        T, e = P + R, y_t - x
        log += -0.5 * (np.log(2 * np.pi * T) + e * e / T)
        x, P = -a * y_t + d * R / T * e, d * d * R * (1 - R / T)
    integral = np.log(weights @ np.exp(log) / weights.sum())
    est = dw.Joint(1, noise=dw.models.NoisePolynomial([d], R), s0=[x0, a0], P0=[Px, Pa])
    found = est.loglik(est.scan(y).state)
    return Verdict(
        "the likelihood is the marginal one, parameters integrated out",
        f"{found:.12f}, quadrature {integral:.12f}",
        "equal to 1e-10",
        abs(found - integral) <= 1e-10,
        SOURCE,
    )


def batch() -> Verdict:
    """Order 3, known C, input and direct term: the recursion against one least squares on data filtered by 1/C."""
    rng, T, n = np.random.default_rng(11), 2000, 3
    u, P0 = rng.standard_normal((1, T)), 100.0
    noise = coloured(TRUE_D, rng.standard_normal((1, T)))
    y, _ = canonical(-PRINTED, *noise, b=np.array([0.3, -0.5, 1.0]), u=u, direct=0.4)
    y, u = y[0], u[0]
    C = np.concatenate([[1.0], TRUE_D[::-1]])
    y_f, u_f, impulse = (lfilter([1.0], C, signal) for signal in (y, u, np.eye(1, T)[0]))

    def lag(signal, k):
        return np.concatenate([np.zeros(k), signal[: T - k]])

    columns = [lag(impulse, n - 1 - i) for i in range(n)]
    columns += [-lag(y_f, n - i) for i in range(n)] + [lag(u_f, n - i) for i in range(n)] + [u_f]
    X, ridge = np.column_stack(columns), np.eye(3 * n + 1) / np.sqrt(P0)
    Q, root = np.linalg.qr(np.vstack([X, ridge]))
    inverse = np.linalg.inv(root)
    mean, covariance = inverse @ (Q.T @ np.concatenate([y_f, np.zeros(len(ridge))])), inverse @ inverse.T
    est = dw.Joint(n, 1, True, noise=dw.models.NoisePolynomial(TRUE_D, 1.0), P0=P0)
    state = est.scan(y, u).state
    off = max(
        np.abs(est.mean(state)[n:] - mean[n:]).max(), np.abs(est.covariance(state)[n:, n:] - covariance[n:, n:]).max()
    )
    return Verdict(
        "recursion = one least squares on y, u filtered by 1/C",
        short(off),
        "≤ 1e-9 in mean and covariance",
        bool(off <= 1e-9),
        SOURCE,
    )


def operations() -> Verdict:
    """Every operation of the uncompiled driver, for n = 1..6; a third difference would be a hidden N^3."""
    n = np.arange(1, 7)
    counts = np.array([counting.per_sample(int(k)) for k in n])
    over = counts - counting.arx(n)
    good = np.all(over <= 3 * n + 24) and np.all(np.diff(counts, 3) == 0)
    return Verdict(
        "operations per sample, U D U', equation error, n = 1 … 6",
        ", ".join(map(str, counts)),
        "≤ 22 n² + 36 n + 8 and 3 n + 24 of book-keeping (likelihood, input statistics); no cubic term",
        bool(good),
        "this package's derivation, docs/decisions/ud.md",
    )
