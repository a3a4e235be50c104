"""Systems that nobody chose: drawn from a seed, declared as data, simulated with their truth.

    y(k) = psi(k)' theta(k) + sigma(k) e(k)

psi is [-y(k-1) .. -y(k-na), u1(k-1) .., u2(k-1) ..] of an ARX system (frozen poles within ``RADIUS`` at all times) or
regressors that are given. *Deviation* of a parameter: sigma / rms(its regressor), what one sample tells of it if all
others are known; a jump of d deviations moves the output by d deviations of the noise. NVR is (step of a walk/deviation)^2
a sample.

| trouble | what is drawn |
|---|---|
| walk all, walk some | NVR of 1e-6 .. 1e-2, one for all or each its own |
| jumps | one to four a record, of .5 .. 8 deviations, of one parameter or all; when and in which direction each record says |
| louder, quieter | the noise times 1.5 .. 10 or over it, in half of the systems for a while only |
| outliers | up to 5 % of the measured outputs, off by 6 .. 25 deviations of the noise (the plant does not feel it) |
| coloured, quantised, closed loop | the input: of pole .8 .. .98; rounded to so many levels; one that acts against y |
| rest | no input for 100 .. 600 samples, in half of the systems no noise either (a hundredth) |
| missing | up to 30 % of the outputs, one by one or in runs |

Every third system has one trouble alone (or none, in turn), the others several together.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

SAMPLES = 2000
RADIUS = 0.95  # of all frozen poles, with and without the loop
FIRST, APART = 200, 100  # samples before the first jump or step of the noise, and between two
QUIET = 0.01  # what is left of the noise in a rest that is quiet
ALONE = (
    "nothing", "walk all", "walk some", "jumps", "louder", "quieter", "outliers", "coloured", "quantised", "closed loop",
    "rest", "missing",
)  # fmt: skip
SHARES = (("walk", 0.45), ("jumps", 0.45), ("noise", 0.35), ("outliers", 0.3), ("input", 0.4), ("rest", 0.2), ("missing", 0.3))


@dataclass(frozen=True)
class System:
    """One system, as data; `about` says it in a line."""

    number: int
    na: int  # past outputs; -1: a regression on regressors that are given
    nb: tuple[int, ...]  # coefficients of each input; of a regression, one each
    theta: tuple[float, ...]  # where its parameters begin
    sigma: float
    deviations: tuple[float, ...]  # of each parameter
    input: tuple[str, float]  # its kind and number: pole, levels, gain of the loop
    nvr: tuple[float, ...] = ()  # of each parameter, 0 where it rests; none: nothing walks
    jumps: tuple[tuple[float, tuple[int, ...]], ...] = ()  # size in deviations, which parameters
    steps: tuple[float, ...] = ()  # what the noise is multiplied with, at each of its steps
    outliers: tuple[float, float] = (0.0, 0.0)  # share, size in deviations of the noise
    rest: tuple[int, bool] = (0, False)  # how many samples, whether the noise rests as well
    missing: tuple[float, int] = (0.0, 1)  # share, mean length of a run

    @property
    def troubles(self) -> tuple[str, ...]:
        """Return the names of what is there, of `ALONE`."""
        walks = [v > 0 for v in self.nvr]
        louder = self.steps[:1] and self.steps[0] > 1
        there = {
            "walk all": all(walks) and any(walks), "walk some": any(walks) and not all(walks), "jumps": self.jumps,
            "louder": louder, "quieter": self.steps and not louder, "outliers": self.outliers[0],
            self.input[0]: self.input[0] in ALONE, "rest": self.rest[0], "missing": self.missing[0],
        }  # fmt: skip
        return tuple(name for name in ALONE if there.get(name)) or ("nothing",)

    @property
    def rests(self) -> bool:
        """Whether its parameters never move."""
        return not self.jumps and not any(self.nvr)

    @property
    def about(self) -> str:
        """Return it in one line."""
        shape = f"regression({len(self.theta)})" if self.na < 0 else f"arx({self.na}; {','.join(map(str, self.nb))})"
        words = [f"{self.number}: {shape} sigma {self.sigma:.2g}, input {self.input[0]} {self.input[1]:.2g}"]
        if any(self.nvr):
            words.append("nvr " + " ".join(f"{v:.0e}" if v else "0" for v in self.nvr))
        words += [f"jump {size:.1f} of {','.join(map(str, who))}" for size, who in self.jumps]
        words += [f"noise x {step:.2g}" for step in self.steps]
        if self.outliers[0]:
            words.append(f"outliers {100 * self.outliers[0]:.1f} % of {self.outliers[1]:.0f}")
        if self.rest[0]:
            words.append(f"rest {self.rest[0]}" + " quiet" * self.rest[1])
        if self.missing[0]:
            words.append(f"missing {100 * self.missing[0]:.0f} % in runs of {self.missing[1]}")
        return ", ".join(words)


@dataclass(frozen=True)
class Records:
    """Records of one system, a row for each seed, with the truth."""

    y: np.ndarray  # (S, T), NaN where missing
    u: np.ndarray  # (S, T, k): inputs, or the regressors
    theta: np.ndarray  # (S, T, n), in the order of psi
    sigma: np.ndarray  # (S, T)
    outliers: np.ndarray  # (S, T), whether y is one
    jumps: np.ndarray  # (S, J), the first samples with new parameters, in order
    moved: np.ndarray  # (S, J, n), by how much


def is_stable(a, radius: float = RADIUS) -> np.ndarray:
    """Say which polynomials 1 + a1/z + .. (last axis) have all roots within ``radius`` (Schur-Cohn, step down)."""
    a = np.asarray(a, float) / radius ** np.arange(1, np.shape(a)[-1] + 1)
    good = np.ones(a.shape[:-1], bool)
    with np.errstate(all="ignore"):
        while a.shape[-1]:
            k = a[..., -1:]
            good &= np.abs(k[..., 0]) < 1
            a = (a[..., :-1] - k * a[..., -2::-1]) / (1 - k * k)
    return good


def stays(system: System, theta) -> np.ndarray:
    """Say whether the plant of ``theta`` (.., n) is stable, by itself and in its loop."""
    if system.na < 1:
        return np.ones(np.shape(theta)[:-1], bool)
    a, (kind, gain) = theta[..., : system.na], system.input
    good = is_stable(a)
    if kind == "closed loop":
        b = theta[..., system.na : system.na + system.nb[0]]
        size = max(system.na, system.nb[0])
        looped = np.zeros((*np.shape(a)[:-1], size))
        looped[..., : system.na] += a
        looped[..., : system.nb[0]] += gain * b
        good = good & is_stable(looped)
    return good


# --- drawing a system --------------------------------------------------------------------------------------


def draw(seed: int, number: int) -> System:
    """Return system ``number`` of ``seed``; whatever else is drawn, it is the same.

    Examples
    --------
    >>> from driftwise_studies.score.worlds import draw, record
    >>> draw(0, 3).troubles
    ('walk all',)
    >>> record(draw(0, 3), seed=1).y.shape
    (1, 2000)
    """
    rng = np.random.default_rng([seed, number, 21])
    chosen = {ALONE[number // 3 % len(ALONE)]} if number % 3 == 0 else several(rng)
    plain = structure(rng, number, chosen)
    return move(rng, trouble(rng, plain, chosen), chosen)


def several(rng) -> set[str]:
    """Return two troubles or more."""
    while True:
        found = {name for name, share in SHARES if rng.random() < share}
        if len(found) > 1:
            break
    for name, kinds in (("walk", ALONE[1:3]), ("noise", ALONE[4:6]), ("input", ALONE[7:10])):
        if name in found:
            found = found - {name} | {str(rng.choice(kinds))}
    return found


def structure(rng, number: int, chosen: set[str]) -> System:
    """Return a plant, its noise and its input."""
    is_arx = rng.random() < 0.7 or "closed loop" in chosen
    kind, value = input_kind(rng, chosen)
    while True:
        na = int(rng.integers(1, 5)) if is_arx else -1
        least = 1 if chosen & {"coloured", "quantised", "closed loop"} else 0
        inputs = int(rng.integers(least, 4)) if is_arx else int(rng.integers(1, 5))
        nb = tuple(int(n) for n in (rng.integers(1, 3, inputs) if is_arx else np.ones(inputs, int)))
        b = rng.uniform(0.3, 1.5, sum(nb)) * rng.choice([-1.0, 1.0], sum(nb))
        theta = np.concatenate([poles(rng, na) if is_arx else [], b])
        sigma = float(10 ** rng.uniform(-1.5, 0))
        if kind == "closed loop":
            value = float(rng.uniform(0.1, 0.8) * np.sign(b[0]))
        found = System(number, na, nb, tuple(theta), sigma, (1.0,) * len(theta), (kind, value))
        if stays(found, theta):
            return with_deviations(found)


def input_kind(rng, chosen) -> tuple[str, float]:
    """Return the kind of input and its number."""
    if "coloured" in chosen:
        return "coloured", float(rng.uniform(0.8, 0.98))
    if "quantised" in chosen:
        return "quantised", float(rng.integers(2, 6))
    return ("closed loop", 0.0) if "closed loop" in chosen else (str(rng.choice(["white", "signs"])), 0.0)


def poles(rng, na: int) -> np.ndarray:
    """Return a1 .. of poles of radius .2 to .9, real or in pairs."""
    roots: list[complex] = []
    while len(roots) < na:
        radius = rng.uniform(0.2, 0.9)
        if na - len(roots) > 1 and rng.random() < 0.7:
            one = radius * np.exp(1j * rng.uniform(0.2, 2.6))
            roots += [one, one.conjugate()]
        else:
            roots.append(radius * rng.choice([1.0, 1.0, -1.0]))
    return np.real(np.poly(roots))[1:]


def with_deviations(system: System) -> System:
    """Return it with the deviations of its parameters, from a record without trouble."""
    found = records(system, range(4), samples=800)
    psi = regressors(system, found.y, found.u)[:, 50:]
    rms = np.sqrt((psi**2).mean(axis=(0, 1)))
    return changed(system, deviations=tuple(float(v) for v in system.sigma / np.maximum(rms, 1e-3 * rms.max())))


def changed(system: System, **what) -> System:
    """Return it with some fields replaced."""
    return System(**{**system.__dict__, **what})


def trouble(rng, system: System, chosen: set[str]) -> System:
    """Return it with the troubles of noise, outputs and input."""
    what: dict = {}
    if chosen & {"louder", "quieter"}:
        first = rng.uniform(1.5, 10) if "louder" in chosen else 1 / rng.uniform(1.5, 10)
        what["steps"] = (float(first), float(1 / first))[: 1 + int(rng.random() < 0.5)]
    if "outliers" in chosen:
        what["outliers"] = (float(rng.uniform(0.002, 0.05)), float(rng.uniform(6, 25)))
    if "rest" in chosen:
        what["rest"] = (int(rng.integers(100, 601)), bool(rng.random() < 0.5))
    if "missing" in chosen:
        what["missing"] = (float(rng.uniform(0.02, 0.3)), int(rng.choice([1, 1, 10])))
    return changed(system, **what)


def move(rng, system: System, chosen: set[str]) -> System:
    """Return it with parameters that walk and jump."""
    n, what = len(system.theta), {}
    if chosen & {"walk all", "walk some"}:
        nvr = 10 ** (rng.uniform(-6, -2, n) if rng.random() < 0.5 else np.full(n, rng.uniform(-6, -2)))
        if "walk some" in chosen and n > 1:
            still = rng.permutation(n)[: rng.integers(1, n)]
            nvr[still] = 0.0
        what["nvr"] = tuple(float(v) for v in nvr)
    if "jumps" in chosen:
        what["jumps"] = tuple(jump(rng, system) for _ in range(rng.integers(1, 5)))
    return changed(system, **what)


def jump(rng, system: System) -> tuple[float, tuple[int, ...]]:
    """Return a jump that the plant survives in one direction at least."""
    n, theta = len(system.theta), np.array(system.theta)
    size = float(np.exp(rng.uniform(np.log(0.5), np.log(8))))
    while True:
        for _ in range(2 * n):
            who = tuple(range(n)) if rng.random() < 0.3 else (int(rng.integers(n)),)
            step = np.zeros(n)
            step[list(who)] = size * np.array(system.deviations)[list(who)]
            if stays(system, theta + step) or stays(system, theta - step):
                return size, who
        size /= 2


# --- simulating it -----------------------------------------------------------------------------------------


def record(system: System, seed: int, samples: int = SAMPLES) -> Records:
    """Return one record (a batch of one) of a system; a seed gives the same whatever the others are."""
    return records(system, [seed], samples)


def records(system: System, seeds, samples: int = SAMPLES) -> Records:
    """Return records of a system, one for each seed."""
    streams = [np.random.default_rng([seed, system.number, 22]) for seed in seeds]
    theta, at, moved = path(system, streams, samples)
    sigma, resting = noise(system, streams, samples)
    e = sigma * np.stack([rng.standard_normal(samples) for rng in streams])
    r = np.stack([source(system, rng, samples) for rng in streams])
    r[resting] = 0.0
    glitch = np.stack([glitches(system, rng, samples) for rng in streams]) * sigma
    gone = np.stack([gaps(system, rng, samples) for rng in streams])
    y, u = run(system, theta, e, r, glitch, gone)
    return Records(y, u, theta, sigma, glitch != 0, at, moved)


def moments(rng, count: int, samples: int) -> np.ndarray:
    """Return when ``count`` things happen, in order and apart."""
    first = min(FIRST, samples // 4)
    slot = (samples - first) / max(count, 1)
    return np.array([int(first + slot * i + rng.uniform() * max(slot - APART, 1)) for i in range(count)], int)


def path(system: System, streams, samples: int):
    """Return theta (S, T, n), when it jumps (S, J) and by how much (S, J, n)."""
    n, count, own = len(system.theta), len(system.jumps), np.array(system.deviations)
    at = np.stack([moments(rng, count, samples) for rng in streams])
    moved = np.zeros((len(streams), count, n))
    for j, (size, who) in enumerate(system.jumps):
        for s, rng in enumerate(streams):
            moved[s, j, list(who)] = size * own[list(who)] * rng.choice([-1.0, 1.0], len(who) if len(who) == 1 else 1)
    steps = np.zeros((len(streams), samples, n))
    if system.nvr:
        drawn = np.stack([rng.standard_normal((samples, n)) for rng in streams])
        steps[:, 1:] = (np.sqrt(system.nvr) * own * drawn)[:, 1:]
    rows = np.arange(len(streams))
    for j in range(count):
        steps[rows, at[:, j]] += moved[:, j]
    theta = np.array(system.theta) + np.cumsum(steps, axis=1)
    lost = ~stays(system, theta).all(axis=1)
    if lost.any():
        theta[lost], moved[lost] = kept_stable(system, steps[lost], at[lost], moved[lost])
    return theta, at, moved


def kept_stable(system: System, steps, at, moved):
    """Return theta and its jumps where no step leaves what is stable: a jump turns back, or is halved; a walk waits."""
    theta, now = np.empty_like(steps), np.tile(np.array(system.theta), (len(steps), 1))
    moved, rows = moved.copy(), np.arange(len(steps))
    for k in range(steps.shape[1]):
        after = now + steps[:, k]
        bad = ~stays(system, after)
        if bad.any():
            after[bad] = now[bad]
            for s, j in zip(*np.nonzero((at == k) & bad[:, None])):
                while not stays(system, now[s] + moved[s, j]):
                    moved[s, j] = -moved[s, j] if stays(system, now[s] - moved[s, j]) else moved[s, j] / 2
                after[s] = now[s] + moved[s, j]
        theta[rows, k] = now = after
    return theta, moved


def noise(system: System, streams, samples: int):
    """Return sigma (S, T), and where the plant rests."""
    sigma, resting = np.full((len(streams), samples), system.sigma), np.zeros((len(streams), samples), bool)
    for s, rng in enumerate(streams):
        for k, step in zip(moments(rng, len(system.steps), samples), system.steps):
            sigma[s, k:] *= step
        if system.rest[0]:
            k = int(rng.integers(FIRST, samples - system.rest[0] - APART))
            resting[s, k : k + system.rest[0]] = True
    if system.rest[1]:
        sigma[resting] *= QUIET
    return sigma, resting


def source(system: System, rng, samples: int) -> np.ndarray:
    """Return inputs (T, k) of variance one, or what is asked of the loop."""
    (kind, value), k = system.input, len(system.nb)
    if kind == "signs":
        return rng.choice([-1.0, 1.0], (samples, k))
    white = rng.standard_normal((samples, k))
    pole = value if kind == "coloured" else 0.9 if kind == "quantised" else 0.0
    for t in range(1, samples if pole else 0):
        white[t] = pole * white[t - 1] + np.sqrt(1 - pole**2) * white[t]
    if kind != "quantised":
        return white
    half = (value - 1) / 2  # so many levels between -2 and 2
    return (np.clip(np.round(white / 2 * half + half), 0, 2 * half) - half) / half * 2


def glitches(system: System, rng, samples: int) -> np.ndarray:
    """Return what is added to the outputs, in deviations of the noise."""
    share, size = system.outliers
    wrong = rng.random(samples) < share
    return wrong * size * rng.choice([-1.0, 1.0], samples) * rng.uniform(0.7, 1.3, samples)


def gaps(system: System, rng, samples: int) -> np.ndarray:
    """Return where the output is missing: runs of geometric length."""
    share, length = system.missing
    if not share:
        return np.zeros(samples, bool)
    begin, go_on = share / ((1 - share) * length), 1 - 1 / length
    drawn, gone = rng.random(samples), np.zeros(samples, bool)
    for t in range(1, samples):
        gone[t] = drawn[t] < (go_on if gone[t - 1] else min(begin, 1.0)) if length > 1 else drawn[t] < share
    return gone


def run(system: System, theta, e, r, glitch, gone):
    """Return measured outputs and the inputs that were applied."""
    if system.na < 0:
        return np.where(gone, np.nan, np.einsum("stn,stn->st", r, theta) + e + glitch), r
    (S, T), na, u = e.shape, system.na, r.copy()
    gain = system.input[1] if system.input[0] == "closed loop" else 0.0
    lags = max([na, *system.nb])
    y, seen, held = np.zeros((S, T + lags)), np.empty((S, T)), np.zeros(S)
    padded = np.concatenate([np.zeros((S, lags, r.shape[2])), u], axis=1)  # u(k) is padded[:, k + lags]
    terms = [(i, lag) for i, n in enumerate(system.nb) for lag in range(1, n + 1)]
    forced = np.zeros((S, T))
    for j, (i, lag) in enumerate(terms):
        if not gain or i:
            forced += theta[:, :, na + j] * padded[:, lags - lag : lags - lag + T, i]
    a = -theta[:, :, na - 1 :: -1] if na == theta.shape[2] else -theta[:, :, :na][:, :, ::-1]
    for k in range(T):
        now = np.einsum("sn,sn->s", a[:, k], y[:, k + lags - na : k + lags]) + forced[:, k] + e[:, k]
        if gain:
            for j in range(system.nb[0]):
                now = now + theta[:, k, na + j] * padded[:, k + lags - 1 - j, 0]
        y[:, k + lags] = now
        seen[:, k] = np.where(gone[:, k], np.nan, now + glitch[:, k])
        if gain:
            held = np.where(gone[:, k], held, seen[:, k])
            padded[:, k + lags, 0] -= gain * held
    return seen, padded[:, lags:]


def regressors(system: System, y, u) -> np.ndarray:
    """Return psi (S, T, n) of measured outputs and inputs, zero before the record."""
    if system.na < 0:
        return u
    psi = np.zeros((*y.shape, len(system.theta)))
    for lag in range(1, system.na + 1):
        psi[:, lag:, lag - 1] = -y[:, :-lag]
    terms = [(i, lag) for i, n in enumerate(system.nb) for lag in range(1, n + 1)]
    for j, (i, lag) in enumerate(terms):
        psi[:, lag:, system.na + j] = u[:, :-lag, i]
    return psi
