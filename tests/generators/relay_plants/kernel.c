/* True and naive models of the three machines, classical RK4 with located switching instants.
 *
 * The first lines of the compiled file are an enum of the parameter indices (see kernel.py).
 * Inputs of a grid interval: u[0] main, u[1] second, u[2] set-point, u[3], u[4] disturbances of
 * the balances of x[0] and x[1]. Each is linear from `left` to `right` inside the interval.
 * States: x[0], x[1] of the machine, x[2] a second storage that is coupled to x[place]. */
#include <math.h>

enum { OVEN, BRIDGE, TANK };
enum { NX = 3, NU = 5, BLOCKED = 2 };
static const double GRAVITY = 9.81;

static double positive(double v) { return v > 0 ? v : 0; }

static void oven(const double *p, int on, const double *u, const double *x, double *f,
                 double *lin, double *non, double *dis)
{
    double amb = u[1];
    double ptc = p[DERATE] > 0 ? exp(-p[DERATE] * positive(x[0] - p[DERATE_AT])) : 1;
    double power = on ? u[0] * u[0] / p[A2] * ptc : 0;
    double exchange = p[A0] * (x[0] - x[1]);
    f[0] = power - exchange;
    f[1] = exchange - p[A1] * (x[1] - amb);
    for (int j = 0; j < 2; j++) {
        lin[j] = x[j] - amb;
        non[j] = (x[j] * x[j] + amb * amb) * (x[j] + amb) * (x[j] - amb);
    }
    dis[0] = 1;
    dis[1] = x[1] - amb;
}

static void bridge(const double *p, int mode, const double *u, const double *x, double *f,
                   double *lin, double *non, double *dis)
{
    double across = -p[A1], from_link = 0;          /* freewheel: one diode */
    if (mode == 1) { across = x[1]; from_link = x[0]; }
    if (mode == -1) { across = -x[1] - 2 * p[A1]; from_link = -x[0]; }
    f[0] = mode == BLOCKED ? 0 : across - p[A0] * x[0];
    f[1] = (u[1] - x[1]) / p[A2] - from_link;
    lin[0] = non[0] = dis[0] = 0;
    lin[1] = dis[1] = x[1];
    non[1] = p[NON1] > 0 ? pow(positive(x[1]) / p[N_REF], p[N_EXP]) : 0;
}

static void tank(const double *p, int on, const double *u, const double *x, double *f,
                 double *lin, double *non, double *dis)
{
    double q_in = on ? u[0] * p[A2] * sqrt(positive(u[1]) / p[P_REF]) : 0;
    for (int j = 0; j < 2; j++) {
        dis[j] = sqrt(2 * GRAVITY * positive(x[j]));
        lin[j] = positive(x[j]);
        non[j] = p[NON0 + j] > 0 ? pow(positive(x[j] - p[N_REF]), p[N_EXP]) : 0;
    }
    f[0] = q_in - p[A0] * dis[0];
    f[1] = p[A0] * dis[0] - p[A1] * dis[1];
}

static void rates(const double *p, int mode, const double *u, const double *x, double *dx)
{
    double f[2], lin[2], non[2], dis[2], second = 0;
    int kind = (int)p[KIND], place = (int)p[PLACE];
    if (kind == OVEN) oven(p, mode, u, x, f, lin, non, dis);
    else if (kind == BRIDGE) bridge(p, mode, u, x, f, lin, non, dis);
    else tank(p, mode, u, x, f, lin, non, dis);
    for (int j = 0; j < 2; j++)
        f[j] -= p[LIN0 + j] * lin[j] + p[NON0 + j] * non[j] + u[3 + j] * dis[j];
    if (p[K2] > 0) {
        second = p[K2] * (x[place] - x[2]);
        f[place] -= second;
        second /= p[S2];
    }
    if (kind == BRIDGE && mode == BLOCKED) f[0] = 0;   /* the diodes block the winding */
    dx[0] = f[0] / p[S0];
    dx[1] = f[1] / p[S1];
    dx[2] = second;
}

static void at(const double *left, const double *right, double s, double *u)
{
    for (int j = 0; j < NU; j++) u[j] = left[j] + s * (right[j] - left[j]);
}

static void rk4(const double *p, int mode, const double *left, const double *right, double h,
                double from, double to, const double *x, double *y)
{
    double u[NU], k1[NX], k2[NX], k3[NX], k4[NX], z[NX], d = h * (to - from);
    at(left, right, from, u);
    rates(p, mode, u, x, k1);
    at(left, right, 0.5 * (from + to), u);
    for (int j = 0; j < NX; j++) z[j] = x[j] + 0.5 * d * k1[j];
    rates(p, mode, u, z, k2);
    for (int j = 0; j < NX; j++) z[j] = x[j] + 0.5 * d * k2[j];
    rates(p, mode, u, z, k3);
    at(left, right, to, u);
    for (int j = 0; j < NX; j++) z[j] = x[j] + d * k3[j];
    rates(p, mode, u, z, k4);
    for (int j = 0; j < NX; j++) y[j] = x[j] + d / 6 * (k1[j] + 2 * k2[j] + 2 * k3[j] + k4[j]);
}

/* True if the guard that leaves `mode` holds at state x. */
static int leaves(const double *p, int mode, const double *u, const double *x)
{
    if ((int)p[KIND] == BRIDGE) return mode <= 0 && x[0] <= 0;
    if (p[HYST] <= 0) return 0;                      /* no switch inside: the command decides */
    return mode ? x[0] >= u[2] + p[HYST] : x[0] <= u[2] - p[HYST];
}

static int successor(const double *p, int mode) { return (int)p[KIND] == BRIDGE ? BLOCKED : !mode; }

/* The mode at the start of an interval, after a change of the inputs. */
static int commanded(const double *p, int mode, const double *u, const double *x)
{
    if ((int)p[KIND] == BRIDGE) mode = u[0] > 0.5 ? 1 : x[0] <= 0 ? BLOCKED : u[0] < -0.5 ? -1 : 0;
    return leaves(p, mode, u, x) ? successor(p, mode) : mode;
}

/* n intervals of length h; states and modes at the n + 1 nodes are written to xs and modes. */
void run(const double *p, long n, double h, const double *left, const double *right,
         double *xs, int *modes)
{
    int mode = 1;
    double x[NX], y[NX], u[NU];
    for (int j = 0; j < NX; j++) x[j] = xs[j];
    for (long k = 0; k < n; k++, left += NU, right += NU) {
        double from = 0;
        mode = commanded(p, mode, left, x);
        modes[k] = mode;
        for (int events = 0; events < 20; events++) {
            rk4(p, mode, left, right, h, from, 1, x, y);
            if (!leaves(p, mode, right, y)) break;
            double low = from, high = 1;
            for (int j = 0; j < 32; j++) {
                double middle = 0.5 * (low + high);
                rk4(p, mode, left, right, h, from, middle, x, y);
                at(left, right, middle, u);
                if (leaves(p, mode, u, y)) high = middle; else low = middle;
            }
            rk4(p, mode, left, right, h, from, high, x, y);
            for (int j = 0; j < NX; j++) x[j] = y[j];
            mode = successor(p, mode);
            if (mode == BLOCKED) x[0] = 0;
            from = high;
        }
        for (int j = 0; j < NX; j++) xs[NX * (k + 1) + j] = x[j] = y[j];
    }
    modes[n] = mode;
}
