"""The complementary error function, after fdlibm's s_erf.c (Sun Microsystems, 1993); its middle is our own."""

import math

from ..dispatch import kernel, rare
from .pairs import add, exp_pair, multiply

NEAR, FAR = 0.5, 3.0  # where the formulas change
LAST = 28.0  # erfc is 0 beyond

# erf x = x + x P(x^2)/Q(x^2)
P0, P1, P2 = 1.28379167095512558561e-01, -3.25042107247001499370e-01, -2.84817495755985104766e-02
P3, P4 = -5.77027029648944159157e-03, -2.37630166566501626084e-05
Q1, Q2, Q3 = 3.97917223959155352819e-01, 6.50222499887672944485e-02, 5.08130628187576562776e-03
Q4, Q5 = 1.32494738004321644526e-04, -3.96022827877536812320e-06

# log(exp(x^2) erfc x) = G0 + G1 t + t^2 (G2 + G3 t + ..) about x = 3/4, 5/4, .. 11/4, by interpolation at Chebyshev's
# points, in 50 digits: of each G0, what is missing from it, G1, what is missing from it, G2, G3 ..
PIECES = (
    -0.6793672606788871, 4.5863751600683466e-17, -0.7258736679806861, -3.7278214783120825e-17,
    0.19214845808061773, -0.05289998957737911, 0.012705625219099652, -0.002270446936908534,
    0.0001296177491028685, 0.00010589142531901295, -5.429463335527519e-05,
    1.4324962879777027e-05, -1.4107884835658103e-06, -7.131404541623875e-07,
    4.6045983317884313e-07, -1.3950002131009323e-07, 1.77516614049391e-08,
    -1.0001536619221256, -9.929445768761704e-17, -0.5677239416692396, -4.216776090576793e-17,
    0.1291898359412214, -0.03268700868262695, 0.007791961611586576, -0.0016069509617381479,
    0.00024678399415189556, -1.0041687964871853e-05, -1.0830877970046843e-05,
    5.1665304306567555e-06, -1.4457580272559436e-06, 2.5086933633874097e-07,
    -1.6322472851585331e-09, -1.9038687526738978e-08, 8.506604437297884e-09,
    -1.2553635254332227, 4.873227161827112e-17, -0.45961090081341544, 1.8096055050039246e-17,
    0.09005983350326342, -0.020538840381637065, 0.004624930498876621, -0.0009640986490900572,
    0.00017452306456785995, -2.3741461915314306e-05, 8.275191925040189e-07,
    8.908517484114955e-07, -4.019277597111866e-07, 1.1314258086916975e-07,
    -2.3081100362546488e-08, 2.7419914583619117e-09, 2.6611550129407317e-10,
    -1.4649598963658184, 4.901211166408032e-17, -0.3829138105445521, 2.001108396770247e-17,
    0.06513243312188328, -0.013312548394200086, 0.0027713368321861742, -0.0005548409098262741,
    0.00010263778797672742, -1.6603895218254856e-05, 2.048289524270585e-06,
    -7.209689449279453e-08, -6.162825309098146e-08, 2.662356134483336e-08,
    -7.3416179251861064e-09, 1.5731242669540166e-09, -2.522736451270265e-10,
    -1.641640410324296, 3.299763145160644e-17, -0.3265359550250292, 6.505224017639783e-18,
    0.048713258719115804, -0.008933257051145546, 0.0017050157913616963, -0.00032065932377768646,
    5.759297340066061e-05, -9.580750488743667e-06, 1.4049309533331912e-06,
    -1.5992497256528052e-07, 6.1545101320177475e-09, 3.688571418244454e-09,
    -1.5465188055049684e-09, 4.158112953071512e-10, -8.853050949259383e-11,
)  # fmt: skip
WIDTH = 17  # of each, that is

# x erfc x = exp(-x^2 - 9/16 + F(1/x^2)/G(1/x^2)), from FAR on
F0, F1, F2 = -9.86494292470009928597e-03, -7.99283237680523006574e-01, -1.77579549177547519889e01
F3, F4, F5 = -1.60636384855821916062e02, -6.37566443368389627722e02, -1.02509513161107724954e03
F6 = -4.83519191608651397019e02
G1, G2, G3 = 3.03380607434824582924e01, 3.25792512996573918826e02, 1.53672958608443695994e03
G4, G5, G6 = 3.19985821950859553908e03, 2.55305040643316442583e03, 4.74528541206955367215e02
G7 = -2.24409524465858183362e01


@rare
def erfc(x):
    """Return 2/sqrt(pi) times the integral of exp(-t^2) from x to inf. The error is below 1 of the last place."""
    if x != x:
        return x
    v = abs(x)
    if v < NEAR:
        return erfc_near(x, beyond(x))
    found = 0.0
    if v < FAR:
        found = erfc_middle(v)
    elif v < LAST:
        found = erfc_tail(v)
    return 2.0 - found if x < 0.0 else found


@kernel
def erfc_both(x):
    """Return erfc(x) and erfc(-x), the same bits as of each alone."""
    if abs(x) < NEAR:
        part = beyond(x)
        return erfc_near(x, part), erfc_near(-x, -part)
    if x != x:
        return x, -x
    found = erfc(abs(x))
    return (2.0 - found, found) if x < 0.0 else (found, 2.0 - found)


@kernel
def beyond(x):
    """Return erf x - x, x below 1/2 in size."""
    z = x * x
    above = P0 + z * (P1 + z * (P2 + z * (P3 + z * P4)))
    return x * (above / (1.0 + z * (Q1 + z * (Q2 + z * (Q3 + z * (Q4 + z * Q5))))))


@kernel
def erfc_near(x, part):
    """Return erfc x where erf x is x and a part."""
    return 1.0 - (x + part) if x < 0.25 else 0.5 - ((x - 0.5) + part)


@rare
def erfc_middle(x):
    """Return erfc x, x from 1/2 to 3; the exponent is a pair."""
    piece = int(2.0 * x) - 1
    at, t = WIDTH * piece, x - (0.5 * piece + 0.75)
    z = t * t
    even, odd = PIECES[at + WIDTH - 1], 0.0
    for i in range(at + WIDTH - 3, at + 3, -2):
        even, odd = PIECES[i] + z * even, PIECES[i + 1] + z * odd
    square, square_low = multiply(x, x)
    slope, slope_low = multiply(PIECES[at + 2], t)
    e, low = add(PIECES[at], slope)
    e, left = add(e, z * (even + t * odd))
    low += left
    e, left = add(-square, e)
    low += left + (PIECES[at + 1] + slope_low + PIECES[at + 3] * t - square_low)
    k, y, y_low = exp_pair(e, low)
    return math.ldexp(y + y_low, k)


@rare
def erfc_tail(x):
    """Return erfc x, x from 3 to 28; the exponent, its exponential and the quotient are pairs."""
    square, square_low = multiply(x, x)
    z = 1.0 / square
    F = F0 + z * (F1 + z * (F2 + z * (F3 + z * (F4 + z * (F5 + z * F6)))))
    G = 1.0 + z * (G1 + z * (G2 + z * (G3 + z * (G4 + z * (G5 + z * (G6 + z * G7))))))
    e, low = add(-square, -0.5625)
    e, left = add(e, F / G)
    k, y, y_low = exp_pair(e, low + left - square_low)
    found = y / x
    whole, rest = multiply(found, x)
    return math.ldexp(found + ((y - whole) - rest + y_low) / x, k)
