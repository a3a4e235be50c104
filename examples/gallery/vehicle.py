"""Cars and lorries on hilly roads: how heavy are they, how steep is the road, and where does the grade change?

Along the road, m dv/dt = F - drag v^2/2 - (rolling + grade) m g, F the force at the wheels. The accelerometer is
noisy (.05 m/s^2), the force is known from the drive. What is measured stands on the left, what is known on the right:

    a = (F - drag v^2/2)/m - g (grade + rolling)

a regression with the parameters 1/m and slope = grade + rolling. `AutoMemory` finds out by itself that 1/m rests and
that slope jumps; jumps are told. Three ways not to do it, and what the library says of each (`trace.diagnose()`):

* The force on the acceleration, F = m a + ..: the regressor is noisy, and the mass comes out too small. Told by the
  whiteness of what is left.
* Cruising at constant speed on a flat road: force and slope go together, and 1/m is anything within bars as wide as
  itself, so that 1/(1/m) is nonsense ("-1600 ± 1200 kg"). Told as identifiability.
* Parameters that may not move (`Constant`) where the grade does: told as drift or jump.

    python examples/gallery/vehicle.py      # exit code 0: every grade is told, all is within two error bars
"""

from __future__ import annotations

import sys

import numpy as np
from scipy.stats import binom

import driftwise as dw

VEHICLES, SAMPLES, DT, G, ROLLING, SEED = 20, 3000, 0.1, 9.81, 0.01, 8
AIR, LARGE = 1.2, 0.02  # kg/m3; a change of the grade that is to be told: four deviations of one acceleration


def drive(number, cruises=False):
    """Return acceleration, force less drag, and of the truth: mass, grade (SAMPLES,), samples where it changes."""
    rng = np.random.default_rng([SEED, number])
    is_lorry = number % 2 == 0
    m = rng.uniform(8000.0, 30000.0) if is_lorry else rng.uniform(1000.0, 2500.0)
    area, strongest = (6.0, 1.4 * m) if is_lorry else (0.7, 4.0 * m)
    grade, wanted = np.zeros(SAMPLES), np.full(SAMPLES, 20.0)
    changes = [] if cruises else [int(at) for at in np.cumsum(rng.integers(400, 900, 7)) if at < SAMPLES]
    for at in changes:
        grade[at:] = np.sign(rng.standard_normal() - 10 * grade[at - 1]) * rng.uniform(0.02, 0.05)
    for at in [] if cruises else np.cumsum(rng.integers(50, 250, 60)):
        wanted[at:] = rng.uniform(5.0, 25.0)
    v, built, a, F = 20.0, 0.0, np.zeros(SAMPLES), np.zeros(SAMPLES)
    speed = np.zeros(SAMPLES)
    for t in range(SAMPLES):
        built = np.clip(built + 0.05 * (wanted[t] - v) * DT, -0.5, 0.5)
        F[t] = np.clip(m * (0.5 * (wanted[t] - v) + built), -strongest, strongest) + 0.5 * AIR * area * v * v
        F[t] += m * G * ROLLING
        speed[t], a[t] = v, (F[t] - 0.5 * AIR * area * v * v) / m - G * (ROLLING + grade[t])
        v = max(v + DT * a[t], 0.0)
    measured = speed + 0.02 * rng.standard_normal(SAMPLES)
    force = F - 0.5 * AIR * area * measured**2
    return a + 0.05 * rng.standard_normal(SAMPLES), force, m, grade, changes


def weigh(a, force, memory=None):
    """Return the trace of 1/m and slope."""
    X = np.column_stack([force, np.full(len(a), -G)])
    est = dw.Regression(["1/m", "slope"], memory=dw.AutoMemory() if memory is None else memory)
    return est.scaled_to(a, X).scan(a, X)


def mass_of(trace):
    """Return the mass and its bar (delta method), or None where 1/m is not known to a half."""
    inverse, bar = trace.parameters[-1][0], trace.parameters_std[-1][0]
    return (1.0 / inverse, bar / inverse**2) if abs(inverse) > 2.0 * bar else None


def pitfalls() -> bool:
    """Show three wrong ways; return whether the library objects to each."""
    a, force, m, *_ = drive(0)
    X = np.column_stack([a, np.full(len(a), G)])
    turned = dw.Regression(["m", "m slope"], memory=dw.AutoMemory()).scaled_to(force, X).scan(force, X)
    flat = drive(1, cruises=True)
    cruise, still = weigh(*flat[:2]), weigh(a, force, dw.memory.Constant())
    (inverse, _), (bar, _) = cruise.parameters[-1], cruise.parameters_std[-1]
    heavy, its_bar = turned.parameters[-1][0], turned.parameters_std[-1][0]
    wrong = (
        ("force on acceleration", m, (heavy, its_bar), turned, "whiteness"),
        ("cruise on a flat road", flat[2], (1 / inverse, bar / inverse**2), cruise, "identifiability"),
        ("nothing may move", m, mass_of(still), still, "drift or jump"),
    )
    objects = True
    for name, truth, said, trace, verdict in wrong:
        found = trace.diagnose().find(verdict)
        objects = objects and not found.is_fine
        print(f"{name}: truth {truth:.0f} kg, answer {said[0]:.0f} ± {said[1]:.0f} kg\n  {verdict}: {found.advice}")
    return objects and mass_of(cruise) is None


def main() -> int:
    """Print truth beside answer; return 0 where all is within two error bars."""
    weighed = known = steps = told = false = 0
    print(" no    mass/kg  answer          grade at the end  answer            steps at, told at")
    for number in range(VEHICLES):
        a, force, m, grade, changes = drive(number)
        trace = weigh(a, force)
        (mass, bar), slope, width = mass_of(trace), trace.parameters[-1][1], trace.parameters_std[-1][1]
        jumps = [event.sample for event in trace.events() if event.kind == "JUMP"]
        large = [at for at in changes if abs(grade[at] - grade[at - 1]) > LARGE]
        hits = [next((j for j in jumps if at <= j < at + 50), None) for at in large]
        weighed, known = weighed + (abs(mass - m) < 2 * bar), known + (abs(slope - ROLLING - grade[-1]) < 2 * width)
        steps, told = steps + len(hits), told + sum(hit is not None for hit in hits)
        false += sum(all(not at <= j < at + 50 for at in changes) for j in jumps)
        pairs = ", ".join(f"{at} {hit}" for at, hit in zip(large, hits))
        line = f"{number:3d} {m:10.0f}  {mass:6.0f} ± {bar:<5.0f}  {grade[-1]:14.4f}"
        print(f"{line}  {slope - ROLLING:7.4f} ± {width:.4f}   {pairs}")
    least = int(binom.ppf(0.025, VEHICLES, 0.954))
    print(f"\nwithin two bars: mass {weighed}, grade {known} of {VEHICLES} (where bars are right, {least} or more)")
    print(f"grade steps of more than {100 * LARGE:.0f} % told: {told} of {steps}; other alarms: {false}\n")
    objects = pitfalls()
    right = min(weighed, known) >= least and told >= 0.95 * steps and false <= VEHICLES // 4 and objects
    print("\nall within two bars" if right else "\nNOT within two bars")
    return 0 if right else 1


if __name__ == "__main__":
    sys.exit(main())
