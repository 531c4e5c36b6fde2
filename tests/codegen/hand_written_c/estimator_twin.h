/* estimator_twin: hand-written C99 twin of the automaton `estimator` (float32, 1 ms).
 *
 * Kalman filter while a flank is in contact, the driveline's own gap flow in between.
 * The caller owns all memory.  estimator_twin_init() once (and again for another calibration),
 * then estimator_twin_step() once per millisecond.  Private to the twin: all of estimator_twin. */
#ifndef ESTIMATOR_TWIN_H
#define ESTIMATOR_TWIN_H

#include <stdbool.h>
#include <stdint.h>

/* memory.mode and memory.run_mode (in `run_mode` DRIVE and COAST stand for *_contact) */
#define ESTIMATOR_TWIN_DRIVE (1)
#define ESTIMATOR_TWIN_GAP   (0)
#define ESTIMATOR_TWIN_COAST (-1)

/* bits of `faults` (all latched) */
#define ESTIMATOR_TWIN_FAULT_EVENT_LIMIT       (1U << 0)
#define ESTIMATOR_TWIN_FAULT_STALE_CALIBRATION (1U << 1)
#define ESTIMATOR_TWIN_FAULT_RANGE_Y_EM        (1U << 2)
#define ESTIMATOR_TWIN_FAULT_RANGE_Y_W         (1U << 3)
#define ESTIMATOR_TWIN_FAULT_RANGE_T_EM        (1U << 4)
#define ESTIMATOR_TWIN_FAULT_RANGE_T_BR        (1U << 5)
#define ESTIMATOR_TWIN_FAULT_RANGE_THETA_D     (1U << 6)
#define ESTIMATOR_TWIN_FAULT_RANGE_W_EM        (1U << 7)
#define ESTIMATOR_TWIN_FAULT_RANGE_W_W         (1U << 8)
#define ESTIMATOR_TWIN_FAULT_RANGE_THETA_B     (1U << 9)

typedef struct {
    float J_em; /* kg*m^2 */
} estimator_twin_cal;

typedef struct {
    float y_em; /* rad/s, measured motor speed */
    float y_w;  /* rad/s, measured wheel speed */
    float T_em; /* N*m */
    float T_br; /* N*m */
    bool is_new_y_em;
    bool is_new_y_w;
} estimator_twin_in;

typedef struct {
    int32_t mode;
    float theta_b, w_b, theta_d, w_d, T_hs;
} estimator_twin_out;

/* What the constant offset f (flow at zero state, backlash angle at its flank) adds to each
 * predicted state in one period: G * f, its two columns apart because they are added apart. */
typedef struct {
    float theta_d_by_w_em, theta_d_by_w_w;
    float w_em_by_w_em, w_em_by_w_w;
    float w_w_by_w_em, w_w_by_w_w;
} estimator_twin_offset;

typedef struct {
    /* state. */
    float theta_d, w_em, w_w, theta_b;
    /* equation. */
    float w_d, T_hs, w_b;
    /* before., latched., innovation. */
    float before_T_em, before_T_br;
    float latched_y_em, latched_y_w, latched_T_em, latched_T_br;
    float innovation_y_em, innovation_y_w;
    /* timer. */
    int32_t drive_gap, gap_drive, gap_coast, coast_gap;
    /* memory. */
    int32_t mode, fired, run_mode;
    uint32_t faults;
    bool started;
    /* derived from the calibration */
    float per_J_em;
    estimator_twin_offset offset_drive, offset_coast;
} estimator_twin;

void estimator_twin_init(estimator_twin *self, const estimator_twin_cal *cal);
void estimator_twin_step(estimator_twin *self, const estimator_twin_cal *cal,
                         const estimator_twin_in *in, estimator_twin_out *out);

#endif
