"""Systems that nobody chose: drawn from a seed, declared as data, simulated with their truth.

    y(k) = psi(k)' theta(k) + sigma(k) e(k)

psi is [-y(k-1) .. -y(k-na), u1(k-1) .., u2(k-1) ..] of an ARX system (frozen poles within ``RADIUS`` at all times) or
regressors that are given. *Deviation* of a parameter: sigma / rms(its regressor), what one sample tells of it if all
others are known; a jump of d deviations moves the output by d deviations of the noise. NVR is the variance of a step of
a walk over deviation^2.

| trouble | what is drawn |
|---|---|
| walk all, walk some | NVR of 1e-6 .. 1e-2, one for all or each its own |
| jumps | one to four, of .5 .. 8 deviations, of one parameter or all; each record says when and in which direction |
| louder, quieter | the noise times 1.5 .. 10 or over it, in half of the systems for a while only |
| outliers | up to 5 % of the measured outputs, off by 6 .. 25 deviations of noise; of plants, a third feel them |
| coloured, quantised, closed loop | the input: of pole .8 .. .98; rounded to so many levels; one that acts against y |
| rest | no input for 100 .. 600 samples, in half of the systems no noise either (a hundredth) |
| missing | up to 30 % of the outputs, one by one or in runs |

Every third system has one trouble alone (or none, in turn), the others several together.

Frozen poles within the radius are a promise for plant and loop as they are at a time; a loop that holds its last
output where the next is missing can still lose its grip. A record whose output exceeds a thousand times what it was at
first is drawn anew.
"""

from .drawing import draw
from .simulation import SAMPLES, Records, record, records, regressors
from .system import ALONE, System, stays

__all__ = ["ALONE", "SAMPLES", "Records", "System", "draw", "record", "records", "regressors", "stays"]
