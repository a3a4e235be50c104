"""The logarithm of the gamma function, after fdlibm's e_lgamma_r.c (Sun Microsystems, 1993)."""

import math

from ..dispatch import rare
from .logarithm import log
from .pairs import add, log_pair, multiply

TINY, LARGE = 2.0**-70, 2.0**58  # -log x below; x (log x - 1) beyond

# about 2, downwards: lgamma(2 - y) = A(y) - y/2
A0, A1, A2 = 7.72156649015328655494e-02, 3.22467033424113591611e-01, 6.73523010531292681824e-02
A3, A4, A5 = 2.05808084325167332806e-02, 7.38555086081402883957e-03, 2.89051383673415629091e-03
A6, A7, A8 = 1.19270763183362067845e-03, 5.10069792153511336608e-04, 2.20862790713908385557e-04
A9, A10, A11 = 1.08011567247583939954e-04, 2.52144565451257326939e-05, 4.48640949618915160150e-05

# about the minimum: lgamma(CENTRE + y) = LEAST + y^2 T(y)
CENTRE, LEAST, LEAST_LOW = 1.46163214496836224576e00, -1.21486290535849611461e-01, -3.63867699703950536541e-18
T0, T1, T2 = 4.83836122723810047042e-01, -1.47587722994593911752e-01, 6.46249402391333854778e-02
T3, T4, T5 = -3.27885410759859649565e-02, 1.79706750811820387126e-02, -1.03142241298341437450e-02
T6, T7, T8 = 6.10053870246291332635e-03, -3.68452016781138256760e-03, 2.25964780900612472250e-03
T9, T10, T11 = -1.40346469989232843813e-03, 8.81081882437654011382e-04, -5.38595305356740546715e-04
T12, T13, T14 = 3.15632070903625950361e-04, -3.12754168375120860518e-04, 3.35529192635519073543e-04

# about 1, upwards: lgamma(1 + y) = U(y)/V(y) - y/2
U0, U1, U2 = -7.72156649015328655494e-02, 6.32827064025093366517e-01, 1.45492250137234768737e00
U3, U4, U5 = 9.77717527963372745603e-01, 2.28963728064692451092e-01, 1.33810918536787660377e-02
V1, V2, V3 = 2.45597793713041134822e00, 2.12848976379893395361e00, 7.69285150456672783825e-01
V4, V5 = 1.04222645593369134254e-01, 3.21709242282423911810e-03

# about 2, upwards: lgamma(2 + y) = y S(y)/R(y) + y/2
S0, S1, S2 = -7.72156649015328655494e-02, 2.14982415960608852501e-01, 3.25778796408930981787e-01
S3, S4, S5 = 1.46350472652464452805e-01, 2.66422703033638609560e-02, 1.84028451407337715652e-03
S6 = 3.19475326584100867617e-05
R1, R2, R3 = 1.39200533467621045958e00, 7.21935547567138069525e-01, 1.71933865632803078993e-01
R4, R5, R6 = 1.86459191715652901344e-02, 7.77942496381893596434e-04, 7.32668430744625636189e-06

# Stirling: lgamma x = (x - 1/2) (log x - 1) + W(1/x)
W0, W1, W2 = 4.18938533204672725052e-01, 8.33333333333329678849e-02, -2.77777777728775536470e-03
W3, W4, W5 = 7.93650558643019558500e-04, -5.95187557450339963135e-04, 8.36339918996282139126e-04
W6 = -1.63092934096575273989e-03


@rare
def lgamma(x):
    """Return the logarithm of the gamma function of x >= 0; nan below. The error is below 2 of the last place."""
    if not x >= 0.0:
        return math.nan
    if x < TINY:
        return -log(x)
    if x < 0.9:  # gamma(x) = gamma(x + 1)/x
        high, low = log_pair(x)
        found, left = add(-high, up_to_two(x, 0.0))
        return found + (left - low)
    if x < 2.0:
        return up_to_two(x, 1.0)
    if x < 8.0:
        return above_two(x)
    return stirling(x) if x < LARGE else x * (log(x) - 1.0)


@rare
def up_to_two(x, one):
    """Return lgamma(x + 1 - one), from 1 to 2; ``one`` is 0 or 1."""
    if x - one >= 0.7316:
        return below_two(1.0 + one - x)
    return about_least(x - (CENTRE - 1.0 + one)) if x - one >= 0.23164 else above_one(x - one)


@rare
def below_two(y):
    """Return lgamma(2 - y)."""
    z = y * y
    even = A0 + z * (A2 + z * (A4 + z * (A6 + z * (A8 + z * A10))))
    odd = z * (A1 + z * (A3 + z * (A5 + z * (A7 + z * (A9 + z * A11)))))
    return (y * even + odd) - 0.5 * y


@rare
def about_least(y):
    """Return lgamma(CENTRE + y); CENTRE is where it is least, between 1 and 2."""
    z = y * y
    w = z * y
    p1 = T0 + w * (T3 + w * (T6 + w * (T9 + w * T12)))
    p2 = T1 + w * (T4 + w * (T7 + w * (T10 + w * T13)))
    p3 = T2 + w * (T5 + w * (T8 + w * (T11 + w * T14)))
    return LEAST + (z * p1 - (LEAST_LOW - w * (p2 + y * p3)))


@rare
def above_one(y):
    """Return lgamma(1 + y)."""
    U = y * (U0 + y * (U1 + y * (U2 + y * (U3 + y * (U4 + y * U5)))))
    V = 1.0 + y * (V1 + y * (V2 + y * (V3 + y * (V4 + y * V5))))
    return U / V - 0.5 * y


@rare
def above_two(x):
    """Return lgamma x, x from 2 to 8: gamma(x) = (x - 1) .. (2 + y) gamma(2 + y)."""
    whole = int(x)
    y, factors = x - whole, 1.0
    S = y * (S0 + y * (S1 + y * (S2 + y * (S3 + y * (S4 + y * (S5 + y * S6))))))
    R = 1.0 + y * (R1 + y * (R2 + y * (R3 + y * (R4 + y * (R5 + y * R6)))))
    for i in range(2, whole):
        factors *= y + i
    return 0.5 * y + S / R + (log(factors) if whole > 2 else 0.0)


@rare
def stirling(x):
    """Return lgamma x, x from 8 to 2^58."""
    z = 1.0 / x
    w = z * z
    W = W0 + z * (W1 + w * (W2 + w * (W3 + w * (W4 + w * (W5 + w * W6)))))
    t, low = log_pair(x)
    t, left = add(t, -1.0)
    found, rest = multiply(x - 0.5, t)
    found, other = add(found, W)
    return found + (other + (rest + (x - 0.5) * (left + low)))
