/* The laws of the generator along a path: states that are not free follow it, those that are free
   move as the generator's own equations say. */
#include "driveline.c"

enum { LAWS = 8 };

/* In the order of LAWS in forms_truth.py; the mesh is given its load as the input `road`. */
static void laws(const Physics *p, const Memory *m, const Drive *d, const double *y, double *out)
{
    double rates[STATES], rate, rate_2;
    Torques t = derivative(p, m, d, y, rates);
    out[0] = motor_torque(p, y, p->lag_omega > 0 ? y[LAG] : d->demand);
    out[1] = motor_friction(p, m, y, d->elapsed);
    out[2] = mesh_loss(p, d->road, y[W_EM]);
    out[3] = t.shaft;
    out[4] = t.gear;
    out[5] = tyre_torque(p, y, &rate, &rate_2);
    out[6] = encoder(p, y);
    out[7] = drag_torque(p, y, d->brake);
}

/* Classical Runge-Kutta from the row y to the row after it; given states go in straight lines. */
static void onward(const Span *s, const Memory *m, const int *is_free, const double *y, double *to)
{
    static const double NODE[4] = {0, 0.5, 0.5, 1}, WEIGHT[4] = {1, 2, 2, 1};
    double slope[STATES], at[STATES], sum[STATES] = {0};
    memcpy(at, y, sizeof at);
    for (int i = 0; i < 4; i++) {
        Drive d = between(&s->from, &s->to, NODE[i], NODE[i] * s->step);
        derivative(s->p, m, &d, at, slope);
        double next = i < 3 ? NODE[i + 1] : 1;
        for (int j = 0; j < STATES; j++) {
            sum[j] += WEIGHT[i] * slope[j];
            at[j] = y[j] + next * (is_free[j] ? s->step * slope[j] : to[j] - y[j]);
        }
    }
    for (int j = 0; j < STATES; j++)
        if (is_free[j]) to[j] = y[j] + s->step / 6 * sum[j];
}

/* Fills the free columns of states[row][STATES] after the first row, and out[row][LAWS], under
   inputs[row][demand, brake, road]. The contacts begin as `contact`; 9: closed for good. */
void walk(const Physics *p, long rows, double step, const int *is_free, int contact,
          const double *inputs, double *states, double *out)
{
    Memory m = {0};
    Span s = {p, {0, 0, 0, 0, 0, 0}, {0, 0, 0, 0, 0, 0}, step};
    for (int i = 0; i < coupling_count(p); i++) {
        m.contact[i] = contact == 9 ? 1 : contact;
        m.stretch[i] = states[coupling(p, i).twist] - states[GAP_0 + i];
    }
    m.angle = states[A_EM];
    m.speed = states[W_EM];
    for (long row = 0; row < rows; row++, states += STATES, inputs += 3) {
        Drive now = {inputs[0], inputs[1], inputs[2], 0, 0, 0};
        s.from = s.to = now;
        laws(p, &m, &now, states, out + LAWS * row);
        if (row == rows - 1) return;
        s.to.demand = inputs[3];
        s.to.brake = inputs[4];
        s.to.road = inputs[5];
        onward(&s, &m, is_free, states, states + STATES);
        remember(p, &m, states + STATES, step);
        s.from = s.to;
        if (contact != 9) change_contacts(&s, &m, states + STATES, 0);
    }
}

/* The demand as the rate limiter lets it through. */
void limit(const Physics *p, long rows, double step, const double *demand, double *out)
{
    out[0] = demand[0];
    for (long row = 1; row < rows; row++)
        out[row] = limited(p, out[row - 1], demand[row - 1], demand[row], step);
}
