"""Print why the filter of continuous time is an exact discretisation: python scripts/continuous_time.py

Part 1: x' = -a y, y = x + white noise, one path. Theorem 3 of Salut et al. (1979) on finer and finer steps, the Ito
form of its limit, and the ordinary differential equation (9) as printed. Part 2: irregular samples of a true plant.
"""

import numpy as np

import driftwise as dw

A, R, SECONDS = 1.3, 0.4, 2.0


def path(steps, seed):
    """Return increments dY of Y' = x + white noise of density R, x' = -a dY/dt, x(0) = 1, on the finest grid."""
    h = SECONDS / steps
    dV = np.sqrt(R * h) * np.random.default_rng(seed).standard_normal(steps)
    x, dY = 1.0, np.empty(steps)
    for t in range(steps):
        dY[t] = x * h + dV[t]
        x -= A * dY[t]
    return dY


def theorem3(dY, h, S0, P0):
    """Exact at every h: y = dY/h has noise variance R/h, and the increment of s = [x, a] is h F(y) s."""
    s, P, H = S0.copy(), P0.copy(), np.array([1.0, 0.0])
    for d in dY:
        F = np.array([[1.0, -d], [0.0, 1.0]])
        T = H @ P @ H + R / h
        L = F @ P @ H
        s, P = F @ s + L * ((d / h - H @ s) / T), F @ P @ F.T - np.outer(L, L) / T
    return s, P


def differential(dY, h, S0, P0, ito):
    """Euler steps of equation (9) as printed, or of the Ito form: two more terms, F1 P H' and R F1 P F1'."""
    s, P, H = S0.copy(), P0.copy(), np.array([1.0, 0.0])
    F1 = np.array([[0.0, -1.0], [0.0, 0.0]])
    for d in dY:
        gain = P @ H / R
        drift = F1 @ P @ H * h if ito else 0.0
        wide = R * F1 @ P @ F1.T * h if ito else 0.0
        ds = F1 @ s * d + drift + gain * (d - H @ s * h)
        dP = (F1 @ P + P @ F1.T) * d + wide - np.outer(gain, gain) * R * h
        s, P = s + ds, P + dP
    return s, P


def compare(seed=0, finest=15):
    """Return {steps: {name: (s, P)}} on one path, coarsened by adding increments."""
    dY, S0, P0 = path(2**finest, seed), np.zeros(2), np.eye(2)
    found = {}
    for power in range(finest - 6, finest + 1, 3):
        steps = 2**power
        d, h = dY.reshape(steps, -1).sum(axis=1), SECONDS / steps
        found[steps] = {
            "theorem 3, exact": theorem3(d, h, S0, P0),
            "Ito form": differential(d, h, S0, P0, True),
            "(9) as printed": differential(d, h, S0, P0, False),
        }
    return found


def discrete(y, u, gap):
    """Return a of the discrete equation error model, blind to jitter, through the logarithms of its poles."""
    est = dw.Joint(2, 1).scaled_to(y, u)
    poles = est.model_of(est.scan(y, u, keep="innovations").state).poles
    return np.real(np.poly(np.log(poles) / gap))[1:]


RATES = (0.2, 0.1, 0.5, 1.0)


def record(seed, jitter, noise, gap):
    """Return (time, y, u) of the plant a = (.3, 1), b = (0, 1) under random signs."""
    rng = np.random.default_rng(seed)
    time = np.cumsum(gap * (1 + jitter * rng.uniform(-1, 1, 400)))
    u = rng.choice([-1.0, 1.0], 400)
    return time, *dw.models.simulate_continuous([0.3, 1.0], [0.0, 1.0], time=time, u=u, noise_std=noise, seed=seed)


def jitter(noise=0.005, gap=0.2, seeds=20, jitters=(0.0, 0.5, 0.9), rates=RATES):
    """Return {jitter: rms errors of a: here for each observer rate (times dt), and in the discrete form}."""
    truth, found = np.array([0.3, 1.0]), {}
    for jitter in jitters:
        errors = []
        for seed in range(seeds):
            time, y, u = record(seed, jitter, noise, gap)
            ours = [dw.ContinuousJoint(2, 1, observer=rate / gap).scaled_to(y, u, time=time) for rate in rates]
            a = [est.scan(y, u, time=time, keep="innovations").state["theta"][:2] for est in ours]
            errors.append(np.array([*a, discrete(y, u, gap)]) - truth)
        found[jitter] = np.sqrt(np.mean(np.square(errors), axis=(0, 2)))
    return found


if __name__ == "__main__":
    print(f"One path, n = 1, a = {A}, R = {R}, {SECONDS:g} s, prior s = 0, P = I")
    print("steps    form               x        a        P_xx    P_aa    smallest eigenvalue of P")
    for steps, forms in compare().items():
        for name, (s, P) in forms.items():
            print(
                f"{steps:<8d} {name:17s} {s[0]:7.4f}  {s[1]:7.4f}   {P[0, 0]:7.4f} {P[1, 1]:7.4f}   "
                f"{np.linalg.eigvalsh(P)[0]:7.4f}"
            )
    print("\nrms error of a, 20 records of 400 samples, gap 0.2 s, noise .005, by the observer's rate c")
    print("jitter    " + "".join(f"{f'{rate:g}/dt':10s}" for rate in RATES) + "discrete form")
    for j, errors in jitter().items():
        print(f"{j:<9g} " + "".join(f"{e:<10.4f}" for e in errors))
    size = np.sqrt(np.mean([np.mean(record(seed, 0.0, 0.0, 0.2)[1] ** 2) for seed in range(20)]))
    print(f"\nthe same without jitter, by the noise on y (y itself has rms {size:.2f})")
    for noise in (0.0, 0.005, 0.02, 0.05, 0.1):
        print(f"{noise:<9g} " + "".join(f"{e:<10.4f}" for e in jitter(noise, jitters=(0.0,))[0.0]))
