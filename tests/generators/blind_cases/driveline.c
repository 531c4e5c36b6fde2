/* Runge-Kutta step with located contact events, run over a recording. */
#include "state.h"
#include "shaft.h"
#include "flow.h"
#include "motion.h"

enum { OUTPUTS = 7, PIECES = 40, FINE = 16 };

/* Inputs between two instants, `part` of the way from the one to the other. */
static Drive between(const Drive *a, const Drive *b, double part, double elapsed)
{
    Drive d = *a;
    d.demand += part * (b->demand - a->demand);
    d.brake += part * (b->brake - a->brake);
    d.road += part * (b->road - a->road);
    d.motor_noise += part * (b->motor_noise - a->motor_noise);
    d.elapsed = elapsed;
    return d;
}

typedef struct { const Physics *p; Drive from, to; double step; } Span;

/* Classical Runge-Kutta from `begin` over `size` [s] within the span. */
static void advance(const Span *s, const Memory *m, const double *y, double begin, double size,
                    double *next)
{
    static const double NODE[4] = {0, 0.5, 0.5, 1}, WEIGHT[4] = {1, 2, 2, 1};
    double slope[STATES], at[STATES], sum[STATES] = {0};
    memcpy(at, y, sizeof at);
    for (int i = 0; i < 4; i++) {
        double part = (begin + NODE[i] * size) / s->step;
        Drive d = between(&s->from, &s->to, part, NODE[i] * size);
        derivative(s->p, m, &d, at, slope);
        double onward = i < 3 ? NODE[i + 1] * size : 0;
        for (int j = 0; j < STATES; j++) {
            sum[j] += WEIGHT[i] * slope[j];
            at[j] = y[j] + onward * slope[j];
        }
    }
    for (int j = 0; j < STATES; j++) next[j] = y[j] + size / 6 * sum[j];
}

/* Negative if the contact state of coupling i cannot last: it would pull, or leave the gap. */
static double guard(const Span *s, const Memory *m, int i, const double *y, double at, double age)
{
    Coupling it = coupling(s->p, i);
    if (m->contact[i] == 0) return it.alpha - fabs(y[GAP_0 + i] - it.centre);
    double rates[STATES], gap_rate, turning;
    Drive d = between(&s->from, &s->to, at / s->step, age);
    derivative(s->p, m, &d, y, rates);
    double torque = coupling_torque(s->p, m, i, y, rates[it.twist], &gap_rate, &turning);
    return m->contact[i] * torque;
}

static int broken(const Span *s, const Memory *m, const double *y, double at, double age)
{
    for (int i = 0; i < coupling_count(s->p); i++)
        if (guard(s, m, i, y, at, age) < 0) return 1;
    return 0;
}

/* Change the contacts that cannot last, the gap position put on its stop. */
static void change_contacts(const Span *s, Memory *m, double *y, double at)
{
    for (int i = 0; i < coupling_count(s->p); i++) {
        if (guard(s, m, i, y, at, 0) >= 0) continue;
        Coupling it = coupling(s->p, i);
        double place = y[GAP_0 + i] - it.centre;
        int side = m->contact[i] ? m->contact[i] : (place > 0 ? 1 : -1);
        y[GAP_0 + i] = it.centre + side * it.alpha;
        m->contact[i] = m->contact[i] ? 0 : side;
    }
}

static void remember(const Physics *p, Memory *m, const double *y, double elapsed)
{
    for (int i = 0; i < coupling_count(p); i++) {
        double stretch = y[coupling(p, i).twist] - y[GAP_0 + i];
        for (int j = 0; j < ELEMENTS; j++)
            m->strain[i][j] = clipped(m->strain[i][j] + stretch - m->stretch[i],
                                      LIMIT[j] * p->iwan_twist);
        m->stretch[i] = stretch;
    }
    for (int j = 0; j < ELEMENTS; j++)
        m->slip[j] = clipped(m->slip[j] + y[A_EM] - m->angle, LIMIT[j] * p->slip_angle);
    m->angle = y[A_EM];
    if (p->bristle_static != 0) m->bristle = bristle_now(p, m, y[W_EM], elapsed);
    m->speed = y[W_EM];
}

/* One span, cut where a contact changes (bisection to 1/16384 of the rest). */
static void integrate(const Span *s, Memory *m, double *y)
{
    double at = 0, next[STATES], trial[STATES];
    for (int piece = 0; at < s->step && piece < PIECES; piece++) {
        double high = s->step - at, low = 0;
        advance(s, m, y, at, high, next);
        int cut = broken(s, m, next, at + high, high);
        for (int i = 0; cut && i < 14; i++) {
            double middle = 0.5 * (low + high);
            advance(s, m, y, at, middle, trial);
            if (broken(s, m, trial, at + middle, middle)) {
                high = middle;
                memcpy(next, trial, sizeof next);
            } else {
                low = middle;
            }
        }
        memcpy(y, next, sizeof next);
        at = cut ? at + high : s->step;
        remember(s->p, m, y, high);
        if (cut) change_contacts(s, m, y, at);
    }
}

static double energy(const Physics *p, const Memory *m, const double *y)
{
    double motor = y[W_EM] + y[W_MOUNT], vehicle = p->J_v - p->rim_J;
    double sum = p->J_em * motor * motor + p->rim_J * y[W_W] * y[W_W];
    sum += vehicle * y[W_V] * y[W_V] + p->mid_J * y[W_MID] * y[W_MID];
    sum += p->mount_J * y[W_MOUNT] * y[W_MOUNT] + p->mount_k * y[MOUNT] * y[MOUNT];
    sum += p->mount_k_2 * (y[MOUNT] - y[MOUNT_2]) * (y[MOUNT] - y[MOUNT_2]);
    sum += p->tyre_k * y[TYRE] * y[TYRE];
    sum += p->tyre_k_2 * (y[TYRE] - y[TYRE_2]) * (y[TYRE] - y[TYRE_2]);
    return 0.5 * sum + spring_energy(p, m, y);
}

static void observe(const Physics *p, const Memory *m, const Drive *d, const double *y, double *out)
{
    double rates[STATES], gap_rate, turning;
    derivative(p, m, d, y, rates);
    out[0] = y[W_EM];
    out[1] = y[SENSE];
    out[2] = coupling_torque(p, m, 0, y, rates[TWIST_0], &gap_rate, &turning);
    out[3] = m->contact[0];
    out[4] = coupling_torque(p, m, 1, y, rates[coupling(p, 1).twist], &gap_rate, &turning);
    out[5] = m->contact[1];
    out[6] = energy(p, m, y);
}

/* Settled guess at a wheel speed [rad/s] and motor torque [N*m]; the run-up does the rest. */
static void start(const Physics *p, Memory *m, double *y, double speed, double torque,
                  double run_up)
{
    double shaft = p->ratio * (torque - p->b_em * p->ratio * speed);
    memset(y, 0, STATES * sizeof *y);
    memset(m, 0, sizeof *m);
    y[W_EM] = p->ratio * speed;
    y[W_W] = y[W_V] = y[W_MID] = speed;
    y[A_W] = -speed * run_up;
    y[A_EM] = y[A_W] * p->ratio;
    y[LAG] = torque;
    y[HEAT_W] = y[HEAT_R] = p->heat_start;
    y[SENSE] = p->sense_scale * speed + p->sense_offset;
    for (int i = 0; i < coupling_count(p); i++) {
        Coupling it = coupling(p, i);
        m->contact[i] = shaft < 0 ? -1 : 1;
        y[GAP_0 + i] = it.centre + m->contact[i] * it.alpha;
        y[it.twist] = y[GAP_0 + i] + shaft / (p->two_shafts > 0 ? p->k : it.k);
        m->stretch[i] = y[it.twist] - y[GAP_0 + i];
    }
    m->angle = y[A_EM];
    m->speed = y[W_EM];
}

/* Fastest change of the limited demand [N*m/s]: slower about zero torque, softly so. */
static double fastest(const Physics *p, double torque)
{
    double way = fmax(0, fmin(1, fabs(torque) / p->rate_band - 0.5));
    double share = p->rate_in_band + (1 - p->rate_in_band) * way * way * (3 - 2 * way);
    return p->rate_limit * share;
}

/* Limited demand a step on, the demand going from `from` to `to`: fine steps, midpoint rule. */
static double limited(const Physics *p, double last, double from, double to, double step)
{
    if (p->rate_limit <= 0) return to;
    double size = step / FINE;
    for (int i = 1; i <= FINE; i++) {
        double goal = from + (to - from) * i / FINE;
        double half = last + clipped(goal - last, 0.5 * size * fastest(p, last));
        last += clipped(goal - last, size * fastest(p, half));
    }
    return last;
}

/* Run over `rows` instants 1 ms apart; inputs[row][demand, brake, road, motor noise];
   outputs[row][motor speed, wheel speed read, coupling 0 torque, contact, 1 torque, contact,
   energy]. Before, `run_up` ms at the first inputs with the vehicle's speed held. */
void driveline_run(const Physics *p, long rows, long run_up, long substeps, double speed,
                   const double *inputs, double *outputs)
{
    Memory m;
    double y[STATES], step = 0.001 / (double)substeps;
    Span s = {p, {inputs[0], inputs[1], inputs[2], inputs[3], 0, 1}, {0, 0, 0, 0, 0, 0}, step};
    start(p, &m, y, speed, inputs[0], 0.001 * (double)run_up);
    for (long row = -run_up; row < rows; row++) {
        const double *now = inputs + 4 * (row > 0 ? row : 0);
        const double *then = row < 0 || row == rows - 1 ? now : now + 4;
        s.from.held = row < 0;
        if (row >= 0) observe(p, &m, &s.from, y, outputs + OUTPUTS * row);
        double before = now[0], rise = (then[0] - now[0]) / (double)substeps;
        for (long i = 1; i <= substeps; i++, before += rise) {
            double part = (double)i / (double)substeps;
            s.to = s.from;
            s.to.demand = limited(p, s.from.demand, before, before + rise, step);
            s.to.brake = now[1] + part * (then[1] - now[1]);
            s.to.road = now[2] + part * (then[2] - now[2]);
            s.to.motor_noise = now[3] + part * (then[3] - now[3]);
            integrate(&s, &m, y);
            s.from = s.to;
        }
    }
}
