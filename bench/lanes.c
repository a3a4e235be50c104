/* The joint filter of an AR equation (no input, order known to the compiler), one series at a time or eight at once.
 *
 * A `real` is a double, or a vector of eight of them (-DLANES): the recursion of joint.c, the same on each lane, so the
 * machine's vector units work on eight series. It shows what a machine can do for a fleet; y (T) or (T, 8), white
 * equation error of known variance R > 0, nothing missing, no policies, no checks, no logarithm (none on vectors in C).
 */
#ifdef LANES
typedef double real __attribute__((vector_size(64)));
#else
typedef double real;
#endif

#define n 3
#define N (2 * n)
#define AT(i, j) ((j) * ((j) - 1) / 2 + (i))

typedef struct {
    real s[N], D[N], U[N * (N - 1) / 2], chi2;
} filter;

/* out (T, 3): prediction, innovation, its variance */
void run(long samples, const real *y, double variance, filter *restrict p, real *restrict out)
{
    filter q = *p;
    for (long t = 0; t < samples; t++, out += 3) {
        real b[N], f = q.s[0] * 0.0 + 1.0, a = f * variance, inverse = 1.0 / a, e = y[t] - q.s[0];
        out[0] = q.s[0], out[1] = e;
#pragma GCC unroll 16
        for (int j = 0; j < N; j++) {
            real h = j ? q.U[AT(0, j)] : f, v = q.D[j] * h, before = a, lambda = -h * inverse;
            a += h * v;
            inverse = 1.0 / a;
            q.D[j] *= before * inverse;
#pragma GCC unroll 16
            for (int i = 0; i < j; i++) {
                real u = q.U[AT(i, j)];
                q.U[AT(i, j)] = u + lambda * b[i];
                b[i] += u * v;
            }
            b[j] = v;
        }
        out[2] = a;
        real gain = e * inverse;
        q.chi2 += e * gain;
#pragma GCC unroll 16
        for (int i = 0; i < N; i++)
            q.s[i] += b[i] * gain;
        /* x+ = shift_up(x) - a y; the same rows of U; then the measured state leaves and a known zero enters */
#pragma GCC unroll 16
        for (int i = 0; i < n; i++)
            q.s[i] = (i + 1 < n ? q.s[i + 1] : 0.0 * f) - y[t] * q.s[n + i];
#pragma GCC unroll 16
        for (int c = n; c < N; c++)
#pragma GCC unroll 16
            for (int i = 0; i < n; i++) {
                real up = i + 1 < n ? q.U[AT(i + 1, c)] : 0.0 * f;
                q.U[AT(i, c)] = n + i < c ? up - y[t] * q.U[AT(n + i, c)] : n + i == c ? up - y[t] : up;
            }
#pragma GCC unroll 16
        for (int j = 0; j + 1 < n; j++) {
#pragma GCC unroll 16
            for (int i = 0; i < j; i++)
                q.U[AT(i, j)] = q.U[AT(i + 1, j + 1)];
            q.D[j] = q.D[j + 1];
        }
#pragma GCC unroll 16
        for (int i = 0; i + 1 < n; i++)
            q.U[AT(i, n - 1)] = 0.0 * f;
        q.D[n - 1] = 0.0 * f;
    }
    *p = q;
}

/* Many series of equal length: y (blocks, T), p (blocks), out (blocks, T, 3). */
void run_blocks(long blocks, long samples, const real *y, double variance, filter *p, real *out)
{
    for (long k = 0; k < blocks; k++)
        run(samples, y + k * samples, variance, p + k, out + 3 * k * samples);
}

long filter_size(void) { return sizeof(filter); }
