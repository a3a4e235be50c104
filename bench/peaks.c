/* What this machine can do at most: arithmetic, its latency, and moving of memory. Seconds are CPU seconds.
 *
 * The compiler may use every instruction of the machine (-march=native), but not fuse a product with a sum on its own:
 * fusing is asked for by name where it is measured, as driftwise's loops do not fuse (a law: same bits everywhere).
 */
#include <math.h>
#include <time.h>

typedef double vector __attribute__((vector_size(64)));

static double now(void)
{
    struct timespec t;
    clock_gettime(CLOCK_PROCESS_CPUTIME_ID, &t);
    return t.tv_sec + 1e-9 * t.tv_nsec;
}

#define CHAINS 12 /* independent ones, enough to hide the latency of each */
#define ALL _Pragma("GCC unroll 12") for (int i = 0; i < CHAINS; i++)

/* Products and sums per second, each an operation, one number at a time. (The asm keeps the compiler from vectors.) */
double scalar_rate(long turns)
{
    double a[CHAINS], b = 0.999999, c = 1e-6, start;
    ALL a[i] = 1.0 + i;
    start = now();
    for (long t = 0; t < turns; t++)
        ALL
        {
            a[i] = a[i] * b + c;
            __asm__ volatile("" : "+x"(a[i]));
        }
    double seconds = now() - start, sum = 0.0;
    ALL sum += a[i];
    return sum == 0.0 ? 0.0 : 2.0 * CHAINS * turns / seconds;
}

/* The same with as many numbers at a time as the machine takes, fused: two operations each. */
double vector_rate(long turns)
{
    vector a[CHAINS], b, c;
    for (int k = 0; k < 8; k++)
        b[k] = 0.999999, c[k] = 1e-6;
    ALL a[i] = b * (1.0 + i);
    double start = now();
    for (long t = 0; t < turns; t++)
        ALL
#if defined(__AVX512F__)
            a[i] = (vector)__builtin_ia32_vfmaddpd512_mask(a[i], b, c, -1, 4);
#else
            a[i] = a[i] * b + c;
#endif
    double seconds = now() - start, sum = 0.0;
    ALL sum += a[i][0] + a[i][7];
    return sum == 0.0 ? 0.0 : 16.0 * CHAINS * turns / seconds;
}

/* Seconds until the result of one operation is there for the next: 0 sum, 1 product, 2 division, 3 root, 4 log. */
double latency(int which, long turns)
{
    double a = 1.5, b = 1.0000001, start = now();
#define CHAIN(step) \
    for (long t = 0; t < turns; t++) { \
        step; \
        __asm__ volatile("" : "+x"(a)); \
    } \
    break;
    switch (which) {
    case 0:
        CHAIN(a = a + b)
    case 1:
        CHAIN(a = a * b)
    case 2:
        CHAIN(a = b / a)
    case 3:
        CHAIN(a = sqrt(a))
    case 4:
        CHAIN(a = log(a + b))
    }
    double seconds = now() - start;
    return a == 0.5 ? 0.0 : seconds / turns;
}

/* Seconds of one of many independent divisions (2), roots (3) or logarithms (4): how soon the next may begin. */
double interval(int which, long turns)
{
    double a[CHAINS], b = 1.0000001, start;
    ALL a[i] = 1.5 + i;
    start = now();
#define CHAINS_OF(step) \
    for (long t = 0; t < turns; t++) { \
        ALL \
        { \
            step; \
            __asm__ volatile("" : "+x"(a[i])); \
        } \
    } \
    break;
    switch (which) {
    case 2:
        CHAINS_OF(a[i] = b / a[i])
    case 3:
        CHAINS_OF(a[i] = sqrt(a[i]))
    case 4:
        CHAINS_OF(a[i] = log(a[i] + 2.0))
    }
    double seconds = now() - start, sum = 0.0;
    ALL sum += a[i];
    return sum == 0.5 ? 0.0 : seconds / (CHAINS * turns);
}

/* The same of a division of eight numbers at once, over eight. */
double lane_interval(long turns)
{
    vector a[CHAINS], b;
    for (int k = 0; k < 8; k++)
        b[k] = 1.0000001;
    ALL a[i] = b * (1.5 + i);
    double start = now();
    for (long t = 0; t < turns; t++)
        ALL a[i] = b / a[i];
    double seconds = now() - start, sum = 0.0;
    ALL sum += a[i][0] + a[i][7];
    return sum == 0.5 ? 0.0 : seconds / (8 * CHAINS * turns);
}

/* Bytes per second of a = b + s c over arrays of n numbers each: two read, one written. */
double triad_rate(double *restrict a, const double *restrict b, const double *restrict c, long n, long turns)
{
    double start = now();
    for (long t = 0; t < turns; t++) {
        double s = 1.0 + t;
        for (long i = 0; i < n; i++)
            a[i] = b[i] + s * c[i];
        __asm__ volatile("" : : "r"(a) : "memory");
    }
    return 24.0 * n * turns / (now() - start);
}
