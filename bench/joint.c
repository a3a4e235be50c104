/* The joint filter as a C programmer would write it: one output, one input, a direct term, order n at run time.
 *
 * The opponent of `make bench`: the same recursion on the same packed U D U' factors as driftwise, R > 0, every
 * sample present, no policies and no checks. U is packed by columns: entry (i, j), i < j, at j (j - 1) / 2 + i.
 * s = [x (measured state first); a1..an; b1..bn; b0], N = 3 n + 1.
 */
#include <math.h>
#include <string.h>

#define MAX_N 16
#define MAX_SIZE (3 * MAX_N + 1)
#define MAX_COLUMNS (MAX_SIZE + 1) /* state, product, spread of a */

typedef struct {
    double s[MAX_SIZE], D[MAX_SIZE], U[MAX_SIZE * (MAX_SIZE - 1) / 2];
    double logdet, chi2;
} filter;

/* Bierman's update with h = [1, 0, .., 0, u]; returns T and fills b = P h. One division per column. */
static double correct(filter *restrict p, int N, double u, double R, double *restrict b)
{
    double a = R, inverse = 1.0 / R, *restrict U = p->U;
    for (int j = 0; j < N; U += j, j++) {
        double f = j ? U[0] : 1.0;
        if (j == N - 1)
            f += u;
        double v = p->D[j] * f, before = a, lambda = -f * inverse;
        a += f * v;
        inverse = 1.0 / a;
        p->D[j] *= before * inverse;
        for (int i = 0; i < j; i++) {
            double Uij = U[i];
            U[i] = Uij + lambda * b[i];
            b[i] += Uij * v;
        }
        b[j] = v;
    }
    return a;
}

/* x+ = shift_up(x) - a y + b u */
static void shift_mean(filter *p, int n, double y, double u)
{
    double *restrict x = p->s;
    const double *a = x + n, *b = x + 2 * n;
    for (int i = 0; i + 1 < n; i++)
        x[i] = x[i + 1] - y * a[i] + u * b[i];
    x[n - 1] = u * b[n - 1] - y * a[n - 1];
}

/* Column c of U, x rows: U+[x, c] = shift_up(U[x, c]) - y U[a, c] + u U[b, c], U unit upper triangular. */
static void shift_column(double *restrict U, int c, int n, double y, double u)
{
    for (int i = 0; i + 1 < n; i++)
        U[i] = U[i + 1];
    U[n - 1] = 0.0;
    int a = c - n < n ? c - n : n, b = c - 2 * n;
    for (int i = 0; i < a; i++)
        U[i] -= y * U[n + i];
    if (c < 2 * n)
        U[c - n] -= y;
    if (b >= 0) {
        if (b < n)
            U[b] += u;
        if (b > n)
            b = n;
        for (int i = 0; i < b; i++)
            U[i] += u * U[2 * n + i];
    }
}

/* No state noise: the measured state leaves the x block, a known zero enters. */
static void drop_measured(filter *p, int n)
{
    double *U = p->U;
    for (int j = 0; j + 1 < n; U += j, j++) {
        memcpy(U, U + j + 1, j * sizeof *U);
        p->D[j] = p->D[j + 1];
    }
    memset(U, 0, (n - 1) * sizeof *U);
    p->D[n - 1] = 0.0;
}

static void write(double *restrict out, const filter *p, int N, int columns, double yhat, double e, double T)
{
    out[0] = yhat, out[1] = e, out[2] = T, out[3] = 0.0;
    if (columns < 4 + N)
        return;
    memcpy(out + 4, p->s, N * sizeof *out);
    if (columns < 4 + 2 * N)
        return;
    double *restrict std = out + 4 + N;
    const double *U = p->U;
    for (int j = 0; j < N; U += j, j++) {
        std[j] = p->D[j];
        for (int i = 0; i < j; i++)
            std[i] += U[i] * U[i] * p->D[j];
    }
    for (int i = 0; i < N; i++)
        std[i] = sqrt(std[i]);
}

static void measure(filter *p, int n, double y, double u, double R, double *restrict out, int columns)
{
    int N = 3 * n + 1;
    double b[MAX_SIZE], yhat = p->s[0] + u * p->s[N - 1], e = y - yhat;
    double T = correct(p, N, u, R, b), gain = e / T;
    for (int i = 0; i < N; i++)
        p->s[i] += b[i] * gain;
    p->chi2 += e * gain;
    p->logdet += log(T);
    write(out, p, N, columns, yhat, e, T);
}

/* White equation error of variance R. out (samples, columns): prediction, innovation, variance, 0[, s[, std]]. */
void equation_error(int n, long samples, const double *y, const double *u, double R, filter *p, double *out, int columns)
{
    int N = 3 * n + 1;
    for (long t = 0; t < samples; t++, out += columns) {
        measure(p, n, y[t], u[t], R, out, columns);
        shift_mean(p, n, y[t], u[t]);
        double *U = p->U + n * (n - 1) / 2;
        for (int c = n; c < N; U += c, c++)
            shift_column(U, c, n, y[t], u[t]);
        drop_measured(p, n);
    }
}

/* Weighted Gram-Schmidt on the rows of the x block: U D U' = Y diag(d) Y'. A variance that no longer matters becomes
 * 0: the state's shrinks geometrically, and would spend the rest of the record in (slow) denormal numbers. */
static void orthogonalise(double Y[MAX_N][MAX_COLUMNS], const double *restrict d, int n, int columns, double negligible,
                          filter *p)
{
    for (int j = n - 1; j >= 0; j--) {
        double w[MAX_COLUMNS], s = 0.0, *U = p->U + j * (j - 1) / 2;
        for (int c = 0; c < columns; c++) {
            w[c] = d[c] * Y[j][c];
            s += w[c] * Y[j][c];
        }
        if (s < negligible)
            s = 0.0;
        p->D[j] = s;
        double inverse = s > 0.0 ? 1.0 / s : 0.0;
        for (int i = 0; i < j; i++) {
            double dot = 0.0;
            for (int c = 0; c < columns; c++)
                dot += Y[i][c] * w[c];
            U[i] = dot *= inverse;
            for (int c = 0; c < columns; c++)
                Y[i][c] -= dot * Y[j][c];
        }
    }
}

/* Output error of known variance R: the state follows x+ = shift_up(x) - a (H s) + b u, and both moments of the
 * product a (H s) are exact for a Gaussian s. */
void output_error(int n, long samples, const double *y, const double *u, double R, filter *p, double *out, int columns)
{
    int N = 3 * n + 1;
    for (long t = 0; t < samples; t++, out += columns) {
        double a[MAX_N], cov[MAX_N] = {0}, var[MAX_N] = {0}, d[MAX_COLUMNS], Y[MAX_N][MAX_COLUMNS], T = 0.0;
        measure(p, n, y[t], u[t], R, out, columns);
        double yhat = p->s[0] + u[t] * p->s[N - 1];
        memcpy(a, p->s + n, n * sizeof *a);

        const double *x = p->U; /* x block of (F - a H) U; T = H P H' */
        for (int j = 0; j < n; x += j, j++) {
            double f = j ? x[0] : 1.0;
            d[j] = p->D[j];
            T += f * f * d[j];
            for (int i = 0; i < n; i++)
                Y[i][j] = (i + 1 < j ? x[i + 1] : i + 1 == j ? 1.0 : 0.0) - a[i] * f;
        }
        double *U = p->U + n * (n - 1) / 2; /* the others; cov(a, H s) and var a on the way */
        for (int c = n; c < N; U += c, c++) {
            double f = c == N - 1 ? U[0] + u[t] : U[0], D = p->D[c], Df = D * f;
            int above = c - n < n ? c - n : n;
            T += f * Df;
            for (int i = 0; i < above; i++) {
                cov[i] += U[n + i] * Df;
                var[i] += U[n + i] * U[n + i] * D;
            }
            if (above < n) {
                cov[above] += Df;
                var[above] += D;
            }
            shift_column(U, c, n, yhat, u[t]);
            for (int i = 0; i < n; i++)
                U[i] -= a[i] * f;
        }
        double widest = 0.0;
        for (int i = 0; i < n; i++)
            widest = var[i] > widest ? var[i] : widest;

        int at = n; /* covariance of the product: cov cov' + T P_aa, the latter only while a is not yet known well */
        d[at] = 1.0;
        for (int i = 0; i < n; i++)
            Y[i][at] = cov[i];
        at++;
        if (widest >= 1e-6) {
            U = p->U + n * (n - 1) / 2;
            for (int c = n; c < N; U += c, c++, at++) {
                d[at] = T * p->D[c];
                for (int i = 0; i < n; i++)
                    Y[i][at] = n + i < c ? U[n + i] : n + i == c ? 1.0 : 0.0;
            }
        }
        shift_mean(p, n, yhat, u[t]);
        for (int i = 0; i < n; i++)
            p->s[i] -= cov[i];
        orthogonalise(Y, d, n, at, 1e-60 * R, p);
    }
}

long filter_size(void) { return sizeof(filter); }
