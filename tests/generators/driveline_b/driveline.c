/* Motor, gap, elastic half-shafts and vehicle, integrated by Runge-Kutta of order 4.

   The gap is that of Nordin, Galic, Gutman 1997: its angle th_b moves so that spring and damper
   carry no torque while it is open. Angles and torques behind the gear are those at the wheel.
   SI units throughout. An effect with size 0 is absent. */

#include <math.h>
#include <string.h>
#include "physics.h"

enum { W_EM, TH_EM, W_W, TH_W, TH_B, T_A, T_B, W_S, PHI, PHI_D, SLIP, W_V, SLIDER, N_STATES = SLIDER + 3 };
enum { DEMAND, BRAKE, MOTOR_NOISE, ROAD_NOISE, N_INPUTS };

static const double RATIO = 9.0;
static const double SLIP_SHARE[3] = {0.2, 0.35, 0.45};        /* of the slip torque */
static const double SLIDER_STIFFNESS[3] = {120.0, 45.0, 15.0}; /* 1/rad, of the slip torque */
static const double GRIP = 2600.0;                             /* largest torque of the tyre */
static const double SHAPE = 1.3;                               /* C of the Magic Formula */
static const double KNEE = 0.06;                               /* rad, twist scale of hardening */

/* The torque that acts at the rotor for a demand u; sets the rates of the actuator's states. */
static double motor_torque(const Physics *p, const double *s, double *ds, double u, double t)
{
    double torque = u;
    if (p->lag > 0.0) { /* critically damped, second order */
        double w = 2.0 / p->lag;
        ds[T_A] = s[T_B];
        ds[T_B] = w * w * (u - s[T_A]) - 2.0 * w * s[T_B];
        torque = s[T_A];
    }
    if (p->rate > 0.0) { /* follows within 5 ms, no faster than the rate */
        ds[T_B] = fmin(fmax(200.0 * (u - s[T_B]), -p->rate), p->rate);
        torque = s[T_B];
    }
    if (p->power > 0.0) { /* power limit with a soft knee, in drive */
        double limit = p->power / fmax(fabs(s[W_EM]), 20.0);
        if (torque > 0.6 * limit)
            torque = limit * tanh(torque / limit);
    }
    torque *= 1.0 - p->drift * (1.0 - exp(-t / 6.0)); /* the magnets warm up */
    if (p->ripple > 0.0)
        torque += p->ripple * (sin(p->order * s[TH_EM] + 0.7)
                               + 0.25 * sin(2.0 * p->order * s[TH_EM] + 2.0));
    return torque;
}

/* The torque of the half-shafts at the wheel; sets the rates of gap and sliders. */
static double shaft_torque(const Physics *p, const double *s, double *ds)
{
    double twist = s[TH_EM] / RATIO + s[PHI] - s[TH_W];
    double rate = s[W_EM] / RATIO + s[PHI_D] - s[W_W];
    double x = twist - s[TH_B];
    double spring = p->k * x;
    if (p->hardening > 0.0)
        spring = p->k * (x + 0.18 * KNEE * p->hardening * copysign(pow(fabs(x) / KNEE, 2.5), x));
    else if (p->hardening < 0.0)
        spring = p->k * 2.0 * KNEE / -p->hardening * tanh(-p->hardening * x / (2.0 * KNEE));
    if (p->unround != 0.0)
        spring *= 1.0 + p->unround * sin(3.0 * s[TH_W]);
    double gap_rate = rate + spring / p->c;
    if ((s[TH_B] >= p->alpha && gap_rate > 0.0) || (s[TH_B] <= -p->alpha && gap_rate < 0.0))
        gap_rate = 0.0;
    ds[TH_B] = gap_rate;
    double torque = spring + p->c * (rate - gap_rate);
    if (p->second > 0.0) /* a softer coupling in parallel, that reaches its end at this twist */
        torque += 0.25 * p->k * fmin(fmax(twist, -p->second), p->second);
    if (p->slip > 0.0) /* Maxwell slip: Iwan 1966; Al-Bender 2005 */
        for (int j = 0; j < 3; j++) {
            double most = SLIP_SHARE[j] * p->slip, own = s[SLIDER + j];
            double change = rate * SLIDER_STIFFNESS[j] * p->slip;
            int slides = (own >= most && change > 0.0) || (own <= -most && change < 0.0);
            ds[SLIDER + j] = slides ? 0.0 : change;
            torque += own;
        }
    return torque;
}

static void derivative(const Physics *p, const double *s, double *ds, const double *u, double t)
{
    memset(ds, 0, N_STATES * sizeof *ds);
    double delivered = motor_torque(p, s, ds, u[DEMAND], t);
    double shaft = shaft_torque(p, s, ds);
    double loss = 0.0;
    if (p->loss > 0.0) /* teeth under load, and a part from preload */
        loss += p->loss * (fabs(shaft) + 0.15 * 200.0) / RATIO * tanh(s[W_EM] / 1.5);
    if (p->friction > 0.0) /* dry, with a Stribeck share: Armstrong-Helouvry 1994 */
        loss += p->friction * (1.0 + 0.6 * exp(-pow(s[W_EM] / 25.0, 2.0))) * tanh(s[W_EM] / 0.7);
    ds[W_EM] = (delivered + u[MOTOR_NOISE] - shaft / RATIO - p->b_em * s[W_EM] - loss) / p->J_em;
    ds[TH_EM] = s[W_EM];
    double grade = p->grade != 0.0 ? p->grade * (1.0 + 0.5 * sin(0.35 * t + 1.0)) : 0.0;
    double body = p->C_t > 0.0 ? s[W_V] : s[W_W];
    double load = p->f0 * tanh(body / 0.3) + p->cd2 * body * fabs(body) + grade - u[ROAD_NOISE];
    double brake = u[BRAKE] * tanh(s[W_W] / 0.2) + p->b_w * s[W_W];
    if (p->C_t > 0.0) { /* transient slip with a relaxation length: Pacejka 2012, ch. 7 */
        double speed = fmax(fabs(s[W_V]), 5.0);
        double steady = (s[W_W] - s[W_V]) / speed;
        double force = GRIP * sin(SHAPE * atan(p->C_t / (GRIP * SHAPE) * s[SLIP]));
        ds[SLIP] = 0.3 * speed / p->relaxation * (steady - s[SLIP]);
        ds[W_W] = (shaft - brake - force) / p->J_w;
        ds[W_V] = (force - load) / (p->J_v - p->J_w);
    } else
        ds[W_W] = (shaft - brake - load) / p->J_v;
    ds[TH_W] = s[W_W];
    if (p->k_h > 0.0) { /* the housing turns against the shaft torque */
        ds[PHI] = s[PHI_D];
        ds[PHI_D] = (-shaft - p->k_h * s[PHI] - p->c_h * s[PHI_D]) / p->J_h;
    }
    double seen = s[W_W] * (1.0 + p->eccentric * (sin(s[TH_W] + 0.4) + 0.2 * sin(2.0 * s[TH_W])));
    ds[W_S] = (seen - s[W_S]) / p->tau_f;
}

/* Integrates over rows of inputs (n_rows, N_INPUTS), `step` seconds apart, torques linear in
   between and disturbances constant. Writes motor and sensed wheel speed of every `stride`-th row
   (rows, 2). `speed` [rad/s] is that of the wheel at the start, `angle` [rad] that of the motor. */
void driveline_run(const Physics *p, long n_rows, long stride, double step, double speed,
                   double angle, const double *inputs, double *out)
{
    double s[N_STATES] = {0}, k1[N_STATES], k2[N_STATES], k3[N_STATES], k4[N_STATES], at[N_STATES];
    double first = inputs[DEMAND];
    s[W_EM] = speed * RATIO;
    s[TH_EM] = angle;
    s[W_W] = s[W_S] = s[W_V] = speed;
    s[T_A] = first;
    s[T_B] = p->lag > 0.0 ? 0.0 : first;
    s[TH_B] = first < 0.0 ? -p->alpha : p->alpha;
    s[TH_W] = angle / RATIO - s[TH_B] - first * RATIO / p->k;
    for (long i = 0; i < n_rows - 1; i++) {
        if (i % stride == 0) {
            *out++ = s[W_EM];
            *out++ = s[W_S];
        }
        const double *u = inputs + i * N_INPUTS;
        double middle[N_INPUTS], last[N_INPUTS], t = (double)i * step;
        memcpy(middle, u, sizeof middle);
        memcpy(last, u, sizeof last);
        for (int j = DEMAND; j <= BRAKE; j++) {
            last[j] = u[N_INPUTS + j];
            middle[j] = 0.5 * (u[j] + last[j]);
        }
        derivative(p, s, k1, u, t);
        for (int j = 0; j < N_STATES; j++) at[j] = s[j] + 0.5 * step * k1[j];
        derivative(p, at, k2, middle, t + 0.5 * step);
        for (int j = 0; j < N_STATES; j++) at[j] = s[j] + 0.5 * step * k2[j];
        derivative(p, at, k3, middle, t + 0.5 * step);
        for (int j = 0; j < N_STATES; j++) at[j] = s[j] + step * k3[j];
        derivative(p, at, k4, last, t + step);
        for (int j = 0; j < N_STATES; j++)
            s[j] += step / 6.0 * (k1[j] + 2.0 * k2[j] + 2.0 * k3[j] + k4[j]);
        s[TH_B] = fmin(fmax(s[TH_B], -p->alpha), p->alpha);
    }
}
