/* Truth of two servo axes: a motor with an elastic belt and a carriage, and a rotary table.

   Units: m, kg, N (belt) or rad, kg*m^2, N*m (table). A cascaded controller runs once per sample.
   Between samples the mechanics is integrated by the classical Runge-Kutta method with `nsub` steps
   per sample. The delivered input and the bristle deflection of dry friction are held in a step. */
#include <math.h>
#include <stdlib.h>
#include <string.h>

enum { /* slots of the parameter vector; Python reads their names from this file */
    ROTARY, M1, M2, B1, B2, K, C,                            /* base: motor or table, carriage, belt */
    KP, KV, KI, MFF, FMAX, LSB, QUANT0, QUANT1,              /* controller, recorded steps */
    U_DELAY, U_RATE, U_LAG, U_LIMIT, U_POWER, U_GAIN, U_OFFSET,
    HEAT_TAU, HEAT_REF, HEAT_START, HEAT_LIMIT, HEAT_PEAK, HEAT_ON, HEAT_FULL, HEAT_GAIN,
    RIPPLE, RIPPLE_N, RIPPLE_PHASE, RIPPLE_SECOND,
    FRIC_C, FRIC_S, FRIC_VS, FRIC_Z, QUAD, LOAD_MU, LOAD_V,
    GAP, CUBIC, POS, POS_HALF, HYST, HYST_YIELD,
    ADD_M, ADD_D, FLEX_M, FLEX_K, FLEX_C,
    S_WHICH, S_DELAY, S_LAG, S_GAIN, S_OFFSET, S_ECC, S_ECC_N, S_ECC_PHASE, S_QUANT,
    SLOTS
};
enum { V1, V2, S, X1, X2, VA, E, N_STATE }; /* speeds, stretch, places, second mass and its stretch */
#define N_SLIP 4

typedef struct {
    double u, fric, dist;         /* held inputs of a step: delivered force, friction, disturbance */
    double slip[N_SLIP], s_start; /* forces of the slipping elements at the start of the step */
} Held;

/* Iwan 1966: spring and slider elements in parallel; slider force in a step is a function of s. */
static double slip_force(const double *p, const Held *h, int i, double s)
{
    double k = p[HYST] * p[K] / N_SLIP, limit = k * p[HYST_YIELD] * 2.0 * (i + 1) / (N_SLIP + 1);
    double f = h->slip[i] + k * (s - h->s_start);
    return fmax(-limit, fmin(limit, f));
}

static double belt_force(const double *p, const Held *h, const double *y)
{
    double e = y[S], rate = y[V1] - y[V2], k = p[K], f;
    if (p[GAP] > 0) {
        e = e > p[GAP] ? e - p[GAP] : e < -p[GAP] ? e + p[GAP] : 0;
        if (e == 0)
            return 0;
    }
    if (p[POS] > 0) { /* two spans with the lengths l (1 + xi) and l (3 - xi) */
        double xi = fmax(-0.97, fmin(0.97, p[POS] * y[X2] / p[POS_HALF]));
        k *= 0.75 * (1 / (1 + xi) + 1 / (3 - xi));
    }
    f = k * e * (1 + p[CUBIC] * e * e) + p[C] * rate;
    if (p[GAP] > 0) /* contact pushes, it does not pull */
        f = e > 0 ? fmax(f, 0) : fmin(f, 0);
    if (p[HYST] > 0)
        for (int i = 0; i < N_SLIP; i++)
            f += slip_force(p, h, i, y[S]);
    return f;
}

static void rates(const double *p, const Held *h, const double *y, double *d)
{
    int rotary = p[ROTARY] > 0;
    double v = rotary ? y[V1] : y[V2]; /* the speed of the body that carries the load */
    double load = h->dist - h->fric - p[QUAD] * v * fabs(v), u = h->u;
    memset(d, 0, N_STATE * sizeof *d);
    if (p[RIPPLE] > 0) {
        double angle = p[RIPPLE_N] * y[X1] + p[RIPPLE_PHASE];
        u += p[RIPPLE] * (sin(angle) + p[RIPPLE_SECOND] * sin(2 * angle));
    }
    if (p[ADD_M] > 0) {
        double f = p[ADD_D] * (v - y[VA]);
        load -= f;
        d[VA] = f / p[ADD_M];
    } else if (p[FLEX_K] > 0) {
        double f = p[FLEX_K] * y[E] + p[FLEX_C] * (v - y[VA]);
        load -= f;
        d[VA] = f / p[FLEX_M];
        d[E] = v - y[VA];
    }
    d[X1] = y[V1];
    if (rotary) {
        d[V1] = (u - p[B1] * y[V1] + load) / (p[M1] - p[FLEX_M]);
    } else {
        double f = belt_force(p, h, y);
        double loss = p[LOAD_MU] > 0 ? p[LOAD_MU] * fabs(f) * tanh(y[V1] / p[LOAD_V]) : 0;
        d[V1] = (u - f - loss - p[B1] * y[V1]) / p[M1];
        d[V2] = (f - p[B2] * y[V2] + load) / (p[M2] - p[FLEX_M]);
        d[S] = y[V1] - y[V2];
        d[X2] = y[V2];
    }
}

static void runge_kutta(const double *p, const Held *h, double *y, double dt)
{
    double a[N_STATE], b[N_STATE], c[N_STATE], d[N_STATE], z[N_STATE];
    int i;
    rates(p, h, y, a);
    for (i = 0; i < N_STATE; i++) z[i] = y[i] + dt / 2 * a[i];
    rates(p, h, z, b);
    for (i = 0; i < N_STATE; i++) z[i] = y[i] + dt / 2 * b[i];
    rates(p, h, z, c);
    for (i = 0; i < N_STATE; i++) z[i] = y[i] + dt * c[i];
    rates(p, h, z, d);
    for (i = 0; i < N_STATE; i++) y[i] += dt / 6 * (a[i] + 2 * b[i] + 2 * c[i] + d[i]);
}

/* LuGre (Canudas de Wit et al. 1995); the bristle equation is solved exactly for a held speed. */
static double bristle(const double *p, double *z, double v, double mass, double dt)
{
    double level = p[FRIC_C] + (p[FRIC_S] - p[FRIC_C]) * exp(-(v / p[FRIC_VS]) * (v / p[FRIC_VS]));
    double stiff = p[FRIC_S] / p[FRIC_Z], end = level / stiff, old = *z, x = fabs(v) * dt / end;
    *z = x < 1e-9 ? old + v * dt : copysign(end, v) + (old - copysign(end, v)) * exp(-x);
    return stiff * *z + 0.8 * sqrt(stiff * mass) * (*z - old) / dt;
}

typedef struct { double rate, lag, heat; } Drive;

/* What the drive makes of the command that reaches it, for one step of the length dt. */
static double deliver(const double *p, Drive *a, double u, double v, double dt)
{
    if (p[U_RATE] > 0)
        u = a->rate += fmax(-p[U_RATE] * dt, fmin(p[U_RATE] * dt, u - a->rate));
    if (p[U_LAG] > 0) {
        double start = a->lag;
        a->lag += (u - start) * -expm1(-dt / p[U_LAG]);
        u = start + (u - start) * -expm1(-dt / 2 / p[U_LAG]); /* in the middle of the step */
    }
    if (p[U_LIMIT] > 0)
        u = fmax(-p[U_LIMIT], fmin(p[U_LIMIT], u));
    if (p[U_POWER] > 0 && fabs(u * v) > p[U_POWER])
        u = copysign(p[U_POWER] / fabs(v), u);
    if (p[HEAT_TAU] > 0) {
        double x = u / p[HEAT_REF], hot = (a->heat - p[HEAT_ON]) / (p[HEAT_FULL] - p[HEAT_ON]);
        if (p[HEAT_LIMIT] > 0) {
            double limit = p[HEAT_PEAK] * (1 - p[HEAT_LIMIT] * fmax(0, fmin(1, hot)));
            u = fmax(-limit, fmin(limit, u));
        }
        u *= 1 - p[HEAT_GAIN] * a->heat;
        a->heat += (x * x - a->heat) * dt / p[HEAT_TAU];
    }
    return u * (1 + p[U_GAIN]) + p[U_OFFSET];
}

/* ref: place, speed, acceleration, injected force, each of n. Returns 1 where the run diverges.
   open = 1: `cmd` is given, without a controller. clean and meas: n rows of ny signals. */
int simulate(const double *p, int n, int nsub, double dt, int open, const double *ref,
             const double *dist, const double *noise, double *cmd, double *clean, double *meas)
{
    int ny = p[ROTARY] > 0 ? 1 : 2, which = (int)p[S_WHICH], bad = 0;
    double y[N_STATE] = {0}, integral = 0, z = 0, seen = 0, h = dt / nsub;
    double mass = p[ROTARY] > 0 ? p[M1] : p[M2];
    double *past = malloc(sizeof(double) * ((size_t)n * nsub + 1));
    Held held = {0};
    Drive drive = {0, 0, p[HEAT_START]};
    for (int k = 0; k < n && !bad; k++) {
        past[(size_t)k * nsub] = y[which];
        for (int i = 0; i < ny; i++) {
            double value = y[i], step = i ? p[QUANT1] : p[QUANT0];
            if (i == which) {
                if (p[S_DELAY] > 0) {
                    double at = k * (double)nsub - p[S_DELAY] / h;
                    size_t j = at > 0 ? (size_t)at : 0;
                    value = at > 0 ? past[j] + (at - j) * (past[j + 1] - past[j]) : past[0];
                }
                if (p[S_LAG] > 0)
                    value = seen;
                value *= 1 + p[S_GAIN] + p[S_ECC] * cos(p[S_ECC_N] * y[X1] + p[S_ECC_PHASE]);
                value += p[S_OFFSET];
            }
            clean[k * ny + i] = value;
            if (!open) {
                double q = i == which && p[S_QUANT] > step ? p[S_QUANT] : step;
                meas[k * ny + i] = q * nearbyint((value + noise[k * ny + i]) / q);
            }
            if (i == which && p[S_QUANT] > step)
                clean[k * ny + i] = p[S_QUANT] * nearbyint(value / p[S_QUANT]);
        }
        if (!open) {
            double e = ref[n + k] + p[KP] * (ref[k] - y[X1]) - meas[k * ny];
            double u = p[MFF] * ref[2 * n + k] + p[KV] * e + integral + ref[3 * n + k];
            if (fabs(u) < p[FMAX])
                integral += p[KI] * e * dt;
            u = fmax(-p[FMAX], fmin(p[FMAX], u));
            cmd[k] = p[LSB] * nearbyint(u / p[LSB]);
        }
        held.dist = dist ? dist[k] : 0;
        for (int j = 0; j < nsub; j++) {
            double now = k, v = p[ROTARY] > 0 ? y[V1] : y[V2], before = y[which];
            if (p[U_DELAY] > 0)
                now = floor(k + ((j + 0.5) * h - p[U_DELAY]) / dt);
            held.u = deliver(p, &drive, now < 0 ? 0 : cmd[(int)now], y[V1], h);
            if (p[FRIC_S] > 0)
                held.fric = bristle(p, &z, v, mass, h);
            held.s_start = y[S];
            runge_kutta(p, &held, y, h);
            if (p[HYST] > 0)
                for (int i = 0; i < N_SLIP; i++)
                    held.slip[i] = slip_force(p, &held, i, y[S]);
            past[(size_t)k * nsub + j + 1] = y[which];
            if (p[S_LAG] > 0)
                seen += ((before + y[which]) / 2 - seen) * -expm1(-h / p[S_LAG]);
        }
        bad = !(fabs(y[V1]) < 1e6);
    }
    free(past);
    return bad;
}
