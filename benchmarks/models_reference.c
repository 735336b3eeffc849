/* The same simulations as a user would write them in C; compiled by models_speed.py with -O3 -march=native -ffast-math. */
#include <math.h>
#define LANES 8

/* Bouc-Wen flux by Heun's method in the current, one vector: theta = A, Lc, kappa, beta, gamma, n, D. */
static double growth(double z, double d, const double *t)
{
    double a = pow(fabs(z), t[5]);
    return t[2] * d - t[3] * d * a - t[4] * fabs(d) * copysign(a, z);
}

void flux_heun(const double *i, long samples, const double *t, double *out)
{
    double z = 0;
    out[0] = t[0] * t[1] * i[0];
    for (long j = 1; j < samples; j++) {
        double d = i[j] - i[j - 1], k1 = growth(z, d, t), k2 = growth(z + k1, d, t);
        z += 0.5 * (k1 + k2);
        out[j] = t[0] * t[1] * i[j] + (1 - t[0]) * t[1] / t[6] * z;
    }
}

/* The same over eight vectors side by side, theta as [parameter][lane], which the compiler turns into vector code. */
void flux_heun_lanes(const double *i, long samples, const double t[7][LANES], double *out)
{
    double z[LANES] = {0};
    for (int p = 0; p < LANES; p++) out[p * samples] = t[0][p] * t[1][p] * i[0];
    for (long j = 1; j < samples; j++) {
        double d = i[j] - i[j - 1], w[LANES];
        for (int p = 0; p < LANES; p++) {
            double a = pow(fabs(z[p]), t[5][p]);
            double k1 = t[2][p] * d - t[3][p] * d * a - t[4][p] * fabs(d) * copysign(a, z[p]);
            double y = z[p] + k1, b = pow(fabs(y), t[5][p]);
            double k2 = t[2][p] * d - t[3][p] * d * b - t[4][p] * fabs(d) * copysign(b, y);
            z[p] += 0.5 * (k1 + k2);
            w[p] = t[0][p] * t[1][p] * i[j] + (1 - t[0][p]) * t[1][p] / t[6][p] * z[p];
        }
        for (int p = 0; p < LANES; p++) out[p * samples + j] = w[p];
    }
}

/* Spencer by RODAS3, one step per sample, eight vectors side by side: no error control, so a lower bound of the work.
   theta = C0, C_inf, K0, K_inf, alpha, A, beta, gamma, n, f0 as [parameter][lane]. */
void spencer_lanes(const double *x, const double *v, long samples, double h, const double t[10][LANES], double *out)
{
    double xs[LANES] = {0}, zs[LANES] = {0};
    for (long j = 0; j < samples; j++) {
        double force[LANES];
        for (int p = 0; p < LANES; p++) {
            double c = 1 / (t[0][p] + t[1][p]), a = t[4][p] * c, k = t[3][p] * c, gain = t[0][p] * c, n = t[8][p];
            double xi = xs[p], z = zs[p], r = 1 / h;
            if (j) {
                double g = gain * v[j - 1], gt = gain * (v[j] - v[j - 1]) * r, w = g - a * z - k * xi;
                double size = fmax(fabs(z), 1e-100), decay = (t[6][p] + copysign(t[7][p], w * z)) * pow(size, n);
                double f = t[5][p] - decay, fz = -n * decay / copysign(size, z);
                double m11 = 2 * r + k, m22 = 2 * r + a * f - w * fz, inv = 1 / (m11 * m22 - a * k * f);
                double i11 = m22 * inv, i12 = -a * inv, i21 = -k * f * inv, i22 = m11 * inv;
                double b = w + 0.5 * h * gt, q = f * b;
                double x1 = i11 * b + i12 * q, z1 = i21 * b + i22 * q;
                b = w + 1.5 * h * gt, q = f * b + 4 * r * z1, b += 4 * r * x1;
                double x2 = i11 * b + i12 * q, z2 = i21 * b + i22 * q, ze = z + 2 * z1, xe = xi + 2 * x1;
                w = g + h * gt - a * ze - k * xe;
                decay = (t[6][p] + copysign(t[7][p], w * ze)) * pow(fabs(ze), n);
                b = w + r * (x1 - x2), q = w * (t[5][p] - decay) + r * (z1 - z2);
                double x3 = i11 * b + i12 * q, z3 = i21 * b + i22 * q;
                ze += z3, xe += x3, w = g + h * gt - a * ze - k * xe;
                decay = (t[6][p] + copysign(t[7][p], w * ze)) * pow(fabs(ze), n);
                b = w + r * (x1 - x2 - 8.0 / 3 * x3), q = w * (t[5][p] - decay) + r * (z1 - z2 - 8.0 / 3 * z3);
                xi = xe + i11 * b + i12 * q, z = ze + i21 * b + i22 * q;
                xs[p] = xi, zs[p] = z;
            }
            double w = gain * v[j] - a * z - k * xi;
            force[p] = t[0][p] * (v[j] - w) + t[2][p] * x[j] + t[9][p];
        }
        for (int p = 0; p < LANES; p++) out[p * samples + j] = force[p];
    }
}

/* theta = fy, a1, a2, c, k, f0. */
void tanh_model(const double *x, const double *v, long samples, const double *t, double *out)
{
    for (long j = 0; j < samples; j++)
        out[j] = t[0] * tanh(t[1] * v[j] + t[2] * x[j]) + t[3] * v[j] + t[4] * x[j] + t[5];
}
