"""What is left of an angle after whole quarter turns."""

import math

from ..dispatch import rare
from .pairs import add, multiply

QUARTER, QUARTER_2, QUARTER_3 = 1.5707963267948966, 6.123233995736766e-17, -1.4973849048591698e-33  # their sum: pi/2
PER_QUARTER = 0.6366197723675814
EIGHTH = 0.7853981633974483
LARGE = 2.0**40  # angles from here on take more digits of pi

# 2/pi, 24 binary digits each
DIGITS = (
    10680707.0, 7228996.0, 1387004.0, 2578385.0, 16069853.0, 12639074.0, 9804092.0, 4427841.0, 16666979.0, 11263675.0,
    12935607.0, 2387514.0, 4345298.0, 14681673.0, 3074569.0, 13734428.0, 16653803.0, 1880361.0, 10960616.0, 8533493.0,
    3062596.0, 8710556.0, 7349940.0, 6258241.0, 3772886.0, 3769171.0, 3798172.0, 8675211.0, 12450088.0, 3874808.0,
    9961438.0, 366607.0, 15675153.0, 9132554.0, 7151469.0, 3571407.0, 2607881.0, 12013382.0, 4155038.0, 6285869.0,
    7677882.0, 13102053.0, 15825725.0, 473591.0, 9065106.0, 15363067.0, 6271263.0, 9264392.0, 5636912.0, 4652155.0,
)  # fmt: skip
PARTS = 8  # of them that matter: 53 digits of the angle, 62 that may cancel, 53 of what is left


@rare
def quarters(x):
    """Return n mod 4, r and what is missing from r: x = n pi/2 + r, |r| about pi/4 at most; x is finite.

    n pi/2 is subtracted in three parts of 53 digits; the products are pairs (Cody and Waite, 1980; Dekker, 1971).
    """
    if abs(x) <= EIGHTH:
        return 0, x, 0.0
    if abs(x) >= LARGE:
        return quarters_of_large(x)
    n = int(x * PER_QUARTER + math.copysign(0.5, x))
    first, first_low = multiply(n + 0.0, QUARTER)
    second, second_low = multiply(n + 0.0, QUARTER_2)
    r, low = add(x - first, -first_low)
    r, left = add(r, -second)
    low += left - (second_low + n * QUARTER_3)
    found = r + low
    return n % 4, found, low - (found - r)


@rare
def quarters_of_large(x):
    """Return the same of a large angle: of x 2/pi, what is no multiple of 4, digit by digit (Payne and Hanek, 1983).

    x = (2^27 a + b) 2^e, whole numbers a < 2^26 and b < 2^27: their products with digits are exact.
    """
    m, e = math.frexp(abs(x))
    a = int(math.ldexp(m, 26))
    b = int(math.ldexp(math.ldexp(m, 26) - a, 27))
    e -= 53
    first = max((e - 2) // 24 + 1, 1)  # digits before it make multiples of 4
    n, r, low = 0, 0.0, 0.0
    for i in range(PARTS):
        digit, weight = DIGITS[first - 1 + i], e - 24 * (first + i)
        for part in range(2):
            product, place = digit * (a if part == 0 else b), weight + (27 if part == 0 else 0)
            if place < 2:
                fours = int(math.ldexp(product, place - 2))
                r, left = add(r, math.ldexp(product, place) - 4.0 * fours)
                low += left
        whole = int(r + math.copysign(0.5, r))
        n += whole
        r, low = add(r - whole, low)
    r, left = multiply(r, QUARTER)
    low = left + (r * (QUARTER_2 / QUARTER) + low * QUARTER)
    sign = math.copysign(1.0, x)
    return (n if x > 0.0 else -n) % 4, sign * r, sign * low
