/* plant_twin: hand-written C99 twin of the automaton `driveline` (float32, major step 0.25 ms).
 *
 * EV driveline as two inertias and one lumped backlash, integrated by RK4 with located crossings.
 * The caller owns all memory.  plant_twin_init() once, then plant_twin_step() once per major step:
 * it flows under the inputs of the call before, then takes the inputs of now. */
#ifndef PLANT_TWIN_H
#define PLANT_TWIN_H

#include <stdbool.h>
#include <stdint.h>

/* memory.mode */
#define PLANT_TWIN_DRIVE_CONTACT (1)
#define PLANT_TWIN_NO_CONTACT    (0)
#define PLANT_TWIN_COAST_CONTACT (-1)

/* bits of `faults`; livelock cannot occur (plant_twin.c, jump) */
#define PLANT_TWIN_FAULT_ZENO     (1U << 0)
#define PLANT_TWIN_FAULT_LIVELOCK (1U << 1)

typedef struct {
    float J_em; /* kg*m^2 */
} plant_twin_cal;

typedef struct {
    float T_em;  /* N*m */
    float T_br;  /* N*m, default 0 */
    float slope; /* rad, default 0 */
} plant_twin_in;

typedef struct {
    float w_em, w_w, w_d, w_b, T_hs, theta_d, theta_b;
    int32_t mode;
} plant_twin_out;

typedef struct {
    /* state. */
    float w_w, w_em, theta_d, theta_b;
    /* equation. */
    float w_d, w_free, T_hs, T_aer, T_rr, T_v, w_b;
    /* before. */
    float before_T_em, before_T_br, before_slope, before_m_g_r_w_sin_slope;
    /* memory. */
    float time;
    int32_t mode, fired;
    uint32_t faults;
    bool armed_0, armed_1, started;
    /* derived from the calibration */
    float per_J_em;
} plant_twin;

void plant_twin_init(plant_twin *self, const plant_twin_cal *cal);
void plant_twin_step(plant_twin *self, const plant_twin_cal *cal, const plant_twin_in *in,
                     plant_twin_out *out);

#endif
