/* What a C programmer would write for a drifting regression: the textbook's covariance form, unguarded, fast.
 *
 * y = h'theta + e, theta takes a random step of variance q per sample. out (samples, N): the estimate after each.
 */
#define N 4

void track(long samples, const double *y, const double *h, double q, double R, double *theta, double *P, double *out)
{
    for (long t = 0; t < samples; t++, h += N, out += N) {
        double b[N], T = R, e = y[t];
        for (int i = 0; i < N; i++)
            P[i * N + i] += q;
        for (int i = 0; i < N; i++) {
            b[i] = 0.0;
            for (int j = 0; j < N; j++)
                b[i] += P[i * N + j] * h[j];
            T += b[i] * h[i];
            e -= theta[i] * h[i];
        }
        for (int i = 0; i < N; i++) {
            out[i] = theta[i] += b[i] * (e / T);
            for (int j = 0; j < N; j++)
                P[i * N + j] -= b[i] * (b[j] / T);
        }
    }
}
