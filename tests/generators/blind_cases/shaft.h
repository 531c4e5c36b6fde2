/* Half-shaft, gaps, gear-side contact. One coupling: torque k*(twist - gap) + c*rates. */

typedef struct {
    double k, c;          /* [N*m/rad], [N*m*s/rad] */
    double alpha, centre; /* half gap and its centre [rad] */
    int twist;            /* which state is its twist */
    int plain;            /* 1: linear contact, whatever the half-shaft's effects */
} Coupling;

static int coupling_count(const Physics *p) { return p->two_shafts > 0 || p->mid_J > 0 ? 2 : 1; }

static Coupling coupling(const Physics *p, int i)
{
    if (p->two_shafts > 0) {
        double share = i ? 1 - p->share_left : p->share_left, side = i ? -1 : 1;
        Coupling half = {share * p->k, share * p->c, p->alpha * (1 + side * p->gap_skew),
                         0.5 * side * p->gap_shift, TWIST_0, 0};
        return half;
    }
    if (i == 1) {
        Coupling gear = {p->mid_k, p->mid_c, p->mid_alpha, 0, TWIST_1, 1};
        return gear;
    }
    Coupling whole = {p->k, p->c, p->alpha, 0, TWIST_0, 0};
    return whole;
}

static double softplus(double value) { return value > 30 ? value : log1p(exp(value)); }

/* Two-stage characteristic with a soft knee, odd in the stretch: stretch that counts [rad]. */
static double kneed(const Physics *p, double stretch)
{
    double width = p->knee_width, twist = p->knee_twist;
    double beyond = softplus((stretch - twist) / width) - softplus((-stretch - twist) / width);
    return stretch + p->knee_gain * width * beyond;
}

/* Iwan: parallel stop operators; the stretch went on monotonically since the memory. */
static double iwan(const Physics *p, const Memory *m, int i, double stretch)
{
    double sum = 0;
    for (int j = 0; j < ELEMENTS; j++)
        sum += SHARE[j] * clipped(m->strain[i][j] + stretch - m->stretch[i],
                                  LIMIT[j] * p->iwan_twist);
    return p->iwan_gain * sum;
}

/* Compliance over that at rest, by the joints' angle; its slope over the angle at *slope. */
static double joint(const Physics *p, double angle, double *slope)
{
    *slope = 0;
    if (p->joint_1 == 0 && p->joint_3 == 0) return 1;
    double turn = angle + p->joint_phase;
    *slope = -p->joint_1 * sin(turn) - 3 * p->joint_3 * sin(3 * turn);
    return 1 + p->joint_1 * cos(turn) + p->joint_3 * cos(3 * turn);
}

/* Torque of the spring alone [N*m]. */
static double spring(const Physics *p, const Memory *m, int i, const Coupling *it,
                     double stretch, double angle)
{
    double counted = stretch, slope;
    if (it->plain) return it->k * stretch;
    if (p->knee_gain != 0) counted = kneed(p, stretch);
    if (p->iwan_gain != 0) counted += iwan(p, m, i, stretch);
    return it->k * counted / joint(p, angle, &slope);
}

/* Torque through a coupling and the rate of its gap position; in the gap the torque is zero
   (Nordin, Galic, Gutman 1997). The joint's angle is worked on too: *turning at the wheel. */
static double coupling_torque(const Physics *p, const Memory *m, int i, const double *y,
                              double rate, double *gap_rate, double *turning)
{
    Coupling it = coupling(p, i);
    double stretch = y[it.twist] - y[GAP_0 + i];
    double torque = spring(p, m, i, &it, stretch, y[A_W]);
    *turning = 0;
    *gap_rate = 0;
    if (m->contact[i] == 0) {
        *gap_rate = rate + torque / it.c;
        return 0;
    }
    if (!it.plain && (p->joint_1 != 0 || p->joint_3 != 0)) {
        double slope, compliance = joint(p, y[A_W], &slope);
        *turning = 0.5 * torque * stretch * slope / compliance;
    }
    return torque + it.c * rate;
}

/* Energy in the linear springs [J]. */
static double spring_energy(const Physics *p, const Memory *m, const double *y)
{
    double sum = 0;
    for (int i = 0; i < coupling_count(p); i++) {
        Coupling it = coupling(p, i);
        double stretch = y[it.twist] - y[GAP_0 + i];
        sum += 0.5 * stretch * spring(p, m, i, &it, stretch, y[A_W]);
    }
    return sum;
}
