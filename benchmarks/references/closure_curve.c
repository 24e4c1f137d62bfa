/* One four-bar of closure_curve.py on its closure curve: m psi'' = -(V' + m' psi'^2 / 2).
   A jet is a value with its first two derivatives by psi. */
#include <complex.h>
#include <math.h>
#include <string.h>

typedef double complex z;
typedef struct { z v, d, dd; } jet;
typedef struct { double l[4], s[3], m[3]; int parallel; } bar;

static jet J(z v, z d, z dd) { jet r = {v, d, dd}; return r; }
static jet add(jet a, jet b) { return J(a.v + b.v, a.d + b.d, a.dd + b.dd); }
static jet by(z c, jet a) { return J(c * a.v, c * a.d, c * a.dd); }
static jet one(jet a) { return J(1 + a.v, a.d, a.dd); }
static jet mul(jet a, jet b)
{
    return J(a.v * b.v, a.d * b.v + a.v * b.d, a.dd * b.v + 2 * a.d * b.d + a.v * b.dd);
}
static jet inverse(jet a)
{
    const z r = 1 / a.v;
    return J(r, -a.d * r * r, 2 * a.d * a.d * r * r * r - a.dd * r * r);
}

static void node(const bar *g, double psi, jet *link)
{
    const double *s = g->s, a0 = g->l[0] * s[0], a1 = g->l[1] * s[1], a2 = g->l[2] * s[2];
    const double A = a2 * a2 / a0 + a2, b = a1 * a2 / a0, c = a1 * a1 / a0 + a1;
    const z turn = cexp(I * psi);
    jet n, d = J(1, 0, 0);
    if (fabs(A) < 1e-12) {
        d = J(cos(psi / 2), -sin(psi / 2) / 2, -cos(psi / 2) / 4);
        n = add(by(-c / (2 * b), d), by(I, J(sin(psi / 2), cos(psi / 2) / 2, -sin(psi / 2) / 4)));
    } else {
        const double r = sqrt(fmax(b * b - A * c, 0)) / fabs(A);
        n = J(-b / A + r * turn, I * r * turn, -r * turn);
    }
    const jet B = by(-1 / a0, add(by(a1, d), by(a2, n)));
    const jet BB = by(a0, mul(B, B)), dd = by(a1, mul(d, d)), nn = by(a2, mul(n, n));
    const jet C = add(BB, add(dd, nn));
    const jet L = add(mul(BB, add(d, n)), add(mul(dd, add(B, n)), mul(nn, add(B, d))));
    jet q = by(-1, mul(C, inverse(L)));
    /* parallelogram and kites: a common factor of C and L, taken out */
    if (a2 == -a0) {
        const double r = a1 / a0;
        q = mul(add(by(-2, n), by(r + 1, d)), inverse(mul(n, add(n, by(-r, d)))));
    } else if (a1 == -a2) {
        const jet e = add(d, by(-1, n));
        q = by(-1, mul(add(by(a1 / a0, e), add(d, n)), inverse(mul(d, n))));
    } else if (a1 == -a0) {
        const double r = a2 / a0;
        q = mul(add(by(-2, d), by(r + 1, n)), inverse(mul(d, add(d, by(-r, n)))));
    }
    link[0] = by(s[0], one(mul(B, q)));
    link[1] = by(s[1], one(mul(d, q)));
    link[2] = by(s[2], one(mul(n, q)));
}

/* Unit vectors along the links. */
static void links(const bar *g, double psi, jet *link)
{
    const z turn = cexp(I * psi);
    if (g->parallel) {
        link[0] = J(turn, I * turn, -turn);
        link[1] = J(1, 0, 0);
        link[2] = by(-1, link[0]);
    } else {
        node(g, psi, link);
    }
}

static void terms(const bar *g, double psi, double *m, double *dm, double *V, double *dV)
{
    jet link[3], base = J(0, 0, 0);
    links(g, psi, link);
    *m = *dm = *V = *dV = 0;
    for (int k = 0; k < 3; k++) {
        const jet centre = add(base, by(g->l[k] / 2, link[k]));
        const double inertia = g->m[k] * g->l[k] * g->l[k] / 12;
        base = add(base, by(g->l[k], link[k]));
        *m += g->m[k] * creal(conj(centre.d) * centre.d) + inertia * creal(conj(link[k].d) * link[k].d);
        *dm += 2 * g->m[k] * creal(conj(centre.d) * centre.dd)
             + 2 * inertia * creal(conj(link[k].d) * link[k].dd);
        *V += g->m[k] * 9.81 * cimag(centre.v);
        *dV += g->m[k] * 9.81 * cimag(centre.d);
    }
}

static void rates(const bar *g, const double *y, double *out)
{
    double m, dm, V, dV;
    terms(g, y[0], &m, &dm, &V, &dV);
    out[0] = y[1];
    out[1] = -(dV + 0.5 * dm * y[1] * y[1]) / m;
}

/* Put psi' back to the energy, where the motion is not slow. */
static void restore(const bar *g, double *y, double energy)
{
    double m, dm, V, dV;
    terms(g, y[0], &m, &dm, &V, &dV);
    const double square = 2 * (energy - V) / m;
    if (m * y[1] * y[1] > 1 && fabs(square - y[1] * y[1]) < 1e-6 * y[1] * y[1])
        y[1] = copysign(sqrt(square), y[1]);
}

/* out: three angles, three angular speeds, the energy. */
void read(const bar *g, const double *y, double *out)
{
    jet link[3];
    double m, dm, V, dV;
    links(g, y[0], link);
    for (int k = 0; k < 3; k++) {
        out[k] = carg(link[k].v);
        out[3 + k] = cimag(link[k].d / link[k].v) * y[1];
    }
    terms(g, y[0], &m, &dm, &V, &dV);
    out[6] = 0.5 * m * y[1] * y[1] + V;
}

/* table: 12 x 12 matrix, 12 weights, 13 and 13 error weights.  out: 2 doubles a time. */
long integrate(const bar *g, const double *y0, int count, const double *times, double tolerance,
               const double *table, double *out)
{
    const double *A = table, *b = A + 144, *e5 = b + 12, *e3 = e5 + 13;
    double y[2] = {y0[0], y0[1]}, t = 0, lost = 0, h = 1e-3, m, dm, V, dV, k[13][2];
    long steps = 0, attempts = 0;
    terms(g, y[0], &m, &dm, &V, &dV);
    const double energy = 0.5 * m * y[1] * y[1] + V;
    for (int n = 0; n < count; n++) {
        for (int last = 0; !last;) {
            const double left = times[n] - t + lost;
            if (++attempts > 300000) {
                for (; n < count; n++) out[2 * n] = out[2 * n + 1] = NAN;
                return -1;
            }
            last = h >= left;
            const double step = last ? left : h;
            double new[2], five = 0, three = 0;
            for (int i = 0; i <= 12; i++) {
                for (int c = 0; c < 2; c++) {
                    double sum = 0;
                    for (int j = 0; j < i; j++) sum += (i < 12 ? A[12 * i + j] : b[j]) * k[j][c];
                    new[c] = y[c] + step * sum;
                }
                rates(g, new, k[i]);
            }
            for (int c = 0; c < 2; c++) {
                double s5 = 0, s3 = 0;
                for (int i = 0; i <= 12; i++) s5 += e5[i] * k[i][c], s3 += e3[i] * k[i][c];
                const double scale = tolerance * fmax(1, fmax(fabs(y[c]), fabs(new[c])));
                five += pow(step * s5 / scale, 2), three += pow(step * s3 / scale, 2);
            }
            const double error = five > 0 ? five / sqrt(2 * (five + 0.01 * three)) : 0;
            const double factor = fmin(4, fmax(0.2, 0.9 * pow(error + 1e-12, -0.125)));
            if (!(error <= 1) && step > 1e-12) {
                h = error == error ? step * factor : 0.2 * step;
                last = 0;
                continue;
            }
            restore(g, new, energy);
            memcpy(y, new, sizeof y);
            if (!last || factor < 1) h = step * factor;
            const double change = step - lost, total = t + change;
            lost = (total - t) - change;
            t = total;
            steps++;
        }
        t = times[n], lost = 0;
        out[2 * n] = y[0], out[2 * n + 1] = y[1];
    }
    return steps;
}
