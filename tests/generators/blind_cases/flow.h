/* Torques at the motor and at the wheel, the tyre, the sensor: plain functions of the states. */

static const double HEAT_TORQUE = 150, HEAT_SPEED = 900; /* unit of heat: [N*m], [rad/s] */
static const double MESH_TORQUE = 1000, MESH_SPEED = 300; /* of mesh_loss: [N*m], [rad/s] */
static const double CREEP_SPEED = 3;                      /* tyre's extra damping [rad/s] */
static const double LIFT_TORQUE = 30;                    /* brake torque that lifts drag [N*m] */

/* Torque of the machine [N*m] from the demand after lag: power limit, drift, offset, ripple. */
static double motor_torque(const Physics *p, const double *y, double torque)
{
    if (p->power_share > 0) {
        double limit = p->power_limit * fmax(0.3, 1 - p->power_heat * y[HEAT_W]);
        double load = fabs(torque * y[W_EM]) / limit;
        torque *= 1 - p->power_share * (1 - pow(1 + pow(load, 8), -0.125));
    }
    if (p->drift_gain != 0) torque *= 1 - p->drift_gain * y[HEAT_R];
    double given = torque + p->torque_offset;
    if (p->ripple_offset != 0 || p->ripple_scale != 0) {
        double turn = p->ripple_order * y[A_EM];
        given += p->ripple_offset * cos(turn + p->ripple_phase);
        given += p->ripple_scale * torque * cos(2 * turn + p->ripple_phase_2);
    }
    return given;
}

static double bristle_limit(const Physics *p, double speed)
{
    double fall = exp(-pow(fabs(speed) / p->bristle_speed, p->bristle_exponent));
    return p->bristle_coulomb + (p->bristle_static - p->bristle_coulomb) * fall;
}

/* LuGre bristle [rad], the speed taken as the mean of the memory's instant and now. */
static double bristle_now(const Physics *p, const Memory *m, double speed, double elapsed)
{
    double mean = 0.5 * (speed + m->speed);
    double limit = bristle_limit(p, mean) / p->bristle_stiffness;
    double settled = mean > 0 ? limit : -limit;
    return settled + (m->bristle - settled) * exp(-fabs(mean) * elapsed / limit);
}

/* Dry friction of the motor [N*m], viscous friction apart. */
static double motor_friction(const Physics *p, const Memory *m, const double *y, double elapsed)
{
    double torque = 0;
    if (p->slip_torque != 0)
        for (int j = 0; j < ELEMENTS; j++) {
            double limit = LIMIT[j] * p->slip_angle;
            double strain = clipped(m->slip[j] + y[A_EM] - m->angle, limit);
            torque += p->slip_torque * SHARE[j] * strain / limit;
        }
    if (p->bristle_static != 0)
        torque += p->bristle_stiffness * bristle_now(p, m, y[W_EM], elapsed);
    return torque;
}

/* Loss of the gear mesh at the motor [N*m]: friction coefficient over load^0.2, speed^-0.2. */
static double mesh_loss(const Physics *p, double torque, double speed)
{
    if (p->mesh_loss == 0) return 0;
    double load = fabs(torque) / MESH_TORQUE, rolling = (fabs(speed) + 10) / MESH_SPEED;
    double share = p->mesh_loss * pow(load + 1e-6, 0.2) * pow(rolling, -0.2);
    return tanh(speed) * share * fabs(torque) / p->ratio;
}

static double slope_torque(const Physics *p, double angle)
{
    double way = fmax(0, fmin(1, (angle - p->grade_at) / p->grade_length));
    double bend = way * way * (3 - 2 * way);
    return p->grade_share * (p->grade_from + (p->grade_to - p->grade_from) * bend);
}

/* Residual torque of the pads: there when the pedal is not. */
static double drag_torque(const Physics *p, const double *y, double brake)
{
    return p->drag_limit > 0 ? y[DRAG] * exp(-brake / LIFT_TORQUE) : 0;
}

static double drag_rate(const Physics *p, const double *y, double brake)
{
    if (p->drag_limit <= 0) return 0;
    double pressed = fmin(p->drag_share * brake, p->drag_limit) - y[DRAG];
    return fmax(0, pressed) / 0.1 - y[DRAG] * (fabs(y[W_W]) / p->drag_turn + 1 / p->drag_s);
}

static double magic(const Physics *p, double slip)
{
    double stiff = p->magic_B * slip;
    double bent = stiff - p->magic_E * (stiff - atan(stiff));
    return p->magic_D * sin(p->magic_C * atan(bent));
}

/* Torque from rim to road or vehicle [N*m]; rates of the tyre's states. */
static double tyre_torque(const Physics *p, const double *y, double *rate, double *rate_2)
{
    double slide = y[W_W] - y[W_V];
    *rate = *rate_2 = 0;
    if (p->magic_D > 0) {
        *rate = slide - fabs(y[W_V]) * y[TYRE] / p->relaxation;
        double extra = p->creep_c * exp(-fabs(y[W_V]) / CREEP_SPEED);
        return magic(p, y[TYRE] / p->relaxation) + extra * slide;
    }
    *rate = slide;
    *rate_2 = (y[TYRE] - y[TYRE_2]) / p->tyre_s;
    return p->tyre_k * y[TYRE] + p->tyre_c * slide + p->tyre_k_2 * (y[TYRE] - y[TYRE_2]);
}

/* Wheel speed as the encoder gives it before the filter [rad/s]. */
static double encoder(const Physics *p, const double *y)
{
    double e = p->eccentricity, turn = cos(y[A_W] + p->eccentricity_phase);
    double error = (e * turn + e * e) / (1 + 2 * e * turn + e * e);
    return p->sense_scale * y[W_W] * (1 + error) + p->sense_offset;
}
