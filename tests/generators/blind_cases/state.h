/* The driveline's states, what it remembers between steps, and what drives it.
   Angles, speeds and torques of wheel and shaft are at the wheel, the motor's at the motor. */
#include <math.h>
#include <string.h>

#include "physics.h" /* struct Physics: written by solver.py from physics.py */

enum {
    W_EM, A_EM,            /* motor: speed [rad/s], angle [rad], relative to the housing */
    W_W, A_W,              /* rim: speed, angle */
    W_V,                   /* vehicle: speed (the rim's own if the tyre is rigid) */
    TWIST_0, TWIST_1,      /* twist of the half-shaft; of the gear-side contact */
    GAP_0, GAP_1,          /* positions in the two gaps [rad] */
    W_MID,                 /* speed between the two gaps */
    MOUNT, W_MOUNT, MOUNT_2, /* housing: angle, speed, angle of the Maxwell damper */
    TYRE, TYRE_2,          /* tyre: deflection, that of the Maxwell damper [rad] */
    LAG, LAG_RATE,         /* lagged torque [N*m] and its rate */
    HEAT_W, HEAT_R,        /* heat of winding and rotor, relative [-] */
    DRAG,                  /* residual brake torque kept by the pads [N*m] */
    SENSE, SENSE_RATE,     /* filtered wheel speed [rad/s] and its rate */
    STATES
};

enum { ELEMENTS = 4 };

static const double SHARE[ELEMENTS] = {0.4, 0.3, 0.2, 0.1}; /* of an element, of the sum */
static const double LIMIT[ELEMENTS] = {0.12, 0.3, 0.6, 1.0}; /* of an element, of the last */
static const double SIGN_SPEED = 0.2;                        /* smooth sign, wheel [rad/s] */

/* What depends on the path: kept at the last accepted instant, moved on from there. */
typedef struct {
    int contact[2];               /* -1, 0 (in the gap), 1 */
    double strain[2][ELEMENTS];   /* Iwan elements of the coupling [rad] */
    double stretch[2];            /* coupling's stretch then [rad] */
    double slip[ELEMENTS];        /* Maxwell-slip elements of the motor [rad] */
    double angle;                 /* motor's angle then [rad] */
    double speed;                 /* and its speed [rad/s] */
    double bristle;               /* LuGre bristle [rad] */
} Memory;

/* Inputs at one instant. */
typedef struct {
    double demand, brake, road, motor_noise; /* [N*m]; the road's torque opposes driving */
    double elapsed;                          /* since the memory's instant [s] */
    int held;                                /* 1: the vehicle's speed is held */
} Drive;

static double sign_smooth(double speed) { return tanh(speed / SIGN_SPEED); }

static double clipped(double value, double limit) { return fmax(-limit, fmin(limit, value)); }
