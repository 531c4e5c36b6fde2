/* Equations of motion: rates of all states from states, memory and inputs. */

typedef struct { double shaft, gear, turning; } Torques;

/* Torques of the couplings; fills the rates of twists and gaps. */
static Torques transmit(const Physics *p, const Memory *m, const double *y, double *dy)
{
    double out = y[W_EM] / p->ratio + y[W_MOUNT], turning;
    double before = p->mid_J > 0 ? y[W_MID] : out;
    dy[TWIST_0] = before - y[W_W];
    dy[TWIST_1] = p->mid_J > 0 ? out - y[W_MID] : 0;
    dy[GAP_1] = 0;
    Torques t;
    t.shaft = t.gear = coupling_torque(p, m, 0, y, dy[TWIST_0], &dy[GAP_0], &t.turning);
    if (p->two_shafts > 0) {
        t.shaft += coupling_torque(p, m, 1, y, dy[TWIST_0], &dy[GAP_1], &turning);
        t.turning += turning;
        t.gear = t.shaft;
    } else if (p->mid_J > 0) {
        t.gear = coupling_torque(p, m, 1, y, dy[TWIST_1], &dy[GAP_1], &turning);
    }
    dy[W_MID] = p->mid_J > 0 ? (t.gear - t.shaft) / p->mid_J : 0;
    return t;
}

/* Motor on its mounts; the motor's speed is relative to the housing. */
static void move_motor(const Physics *p, const double *y, double *dy, double torque, double loss,
                       double gear)
{
    double net = torque - gear / p->ratio - p->b_em * y[W_EM] - loss;
    dy[A_EM] = y[W_EM];
    dy[MOUNT] = dy[W_MOUNT] = dy[MOUNT_2] = 0;
    if (p->mount_J > 0) {
        double branch = p->mount_k_2 * (y[MOUNT] - y[MOUNT_2]);
        double held = p->mount_k * y[MOUNT] + p->mount_c * y[W_MOUNT] + branch;
        dy[MOUNT] = y[W_MOUNT];
        dy[MOUNT_2] = (y[MOUNT] - y[MOUNT_2]) / p->mount_s;
        dy[W_MOUNT] = (-gear - held - net) / p->mount_J;
    }
    dy[W_EM] = net / p->J_em - dy[W_MOUNT];
}

/* Rim, tyre and vehicle. */
static void move_vehicle(const Physics *p, const Drive *d, const double *y, double *dy,
                         double shaft)
{
    double brake = (d->brake + drag_torque(p, y, d->brake)) * sign_smooth(y[W_W]);
    double rim = shaft - brake - p->b_w * y[W_W];
    double load = p->f0 * sign_smooth(y[W_V]) + p->cd2 * y[W_V] * fabs(y[W_V]);
    load += d->road + slope_torque(p, y[A_W]);
    dy[A_W] = y[W_W];
    dy[TYRE] = dy[TYRE_2] = 0;
    if (p->rim_J > 0) {
        double tyre = tyre_torque(p, y, &dy[TYRE], &dy[TYRE_2]);
        dy[W_W] = (rim - tyre) / p->rim_J;
        dy[W_V] = d->held ? 0 : (tyre - load) / (p->J_v - p->rim_J);
    } else {
        dy[W_W] = dy[W_V] = d->held ? 0 : (rim - load) / p->J_v;
    }
    dy[DRAG] = drag_rate(p, y, d->brake);
}

/* Heat, lagged torque, filtered wheel speed. */
static void move_signals(const Physics *p, const Drive *d, const double *y, double *dy,
                         double torque)
{
    double heat = pow(torque / HEAT_TORQUE, 2) + pow(y[W_EM] / HEAT_SPEED, 2);
    int warming = p->power_share > 0 || p->drift_gain != 0;
    dy[HEAT_W] = warming ? (heat - y[HEAT_W]) / p->heat_winding_s : 0;
    dy[HEAT_R] = warming ? (y[HEAT_W] - y[HEAT_R]) / p->heat_rotor_s : 0;
    double corner = p->lag_omega, error = d->demand - y[LAG];
    dy[LAG] = y[LAG_RATE];
    dy[LAG_RATE] = corner * (corner * error - 2 * p->lag_zeta * y[LAG_RATE]);
    double sensed = encoder(p, y) - y[SENSE], omega = p->sense_omega;
    dy[SENSE] = omega > 0 ? y[SENSE_RATE] : sensed / p->tau_f;
    dy[SENSE_RATE] = omega * (omega * sensed - 2 * p->sense_zeta * y[SENSE_RATE]);
}

static Torques derivative(const Physics *p, const Memory *m, const Drive *d, const double *y,
                          double *dy)
{
    double demand = p->lag_omega > 0 ? y[LAG] : d->demand;
    double torque = motor_torque(p, y, demand);
    Torques t = transmit(p, m, y, dy);
    double loss = motor_friction(p, m, y, d->elapsed) + mesh_loss(p, t.gear, y[W_EM]);
    move_motor(p, y, dy, torque + d->motor_noise, loss, t.gear);
    move_vehicle(p, d, y, dy, t.shaft + t.turning);
    move_signals(p, d, y, dy, torque);
    return t;
}
