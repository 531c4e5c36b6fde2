#include <string.h>

#include "duel.h"
#include "estimator.h"
#include "estimator_twin.h"

static estimator_In inputs[MOST_STEPS];
static estimator_twin_in twin_inputs[MOST_STEPS];
static const estimator_twin_cal twin_page = {0.05F};

int duel_inputs(void)
{
    return 6;
}

void duel_feed(const double *record, size_t step)
{
    const estimator_In in = {
        .y_em = (float)record[0], .y_w = (float)record[1],
        .T_em = (float)record[2], .T_br = (float)record[3],
        .is_new = {.y_em = record[4] != 0.0, .y_w = record[5] != 0.0}};
    const estimator_twin_in twin = {
        .y_em = in.y_em, .y_w = in.y_w, .T_em = in.T_em, .T_br = in.T_br,
        .is_new_y_em = in.is_new.y_em, .is_new_y_w = in.is_new.y_w};

    inputs[step] = in;
    twin_inputs[step] = twin;
}

static int64_t apart(const float *a, const float *b)
{
    return memcmp(a, b, sizeof *a) != 0;
}

static int64_t differing(const estimator_Self *one, const estimator_twin *twin)
{
    int64_t count = apart(&one->state.theta_d, &twin->theta_d);

    count += apart(&one->state.w_em, &twin->w_em) + apart(&one->state.w_w, &twin->w_w);
    count += apart(&one->state.theta_b, &twin->theta_b) + apart(&one->equation.w_d, &twin->w_d);
    count += apart(&one->equation.T_hs, &twin->T_hs) + apart(&one->equation.w_b, &twin->w_b);
    count += apart(&one->before.T_em, &twin->before_T_em);
    count += apart(&one->before.T_br, &twin->before_T_br);
    count += apart(&one->latched.y_em, &twin->latched_y_em);
    count += apart(&one->latched.y_w, &twin->latched_y_w);
    count += apart(&one->latched.T_em, &twin->latched_T_em);
    count += apart(&one->latched.T_br, &twin->latched_T_br);
    count += apart(&one->innovation.y_em, &twin->innovation_y_em);
    count += apart(&one->innovation.y_w, &twin->innovation_y_w);
    count += (one->timer.drive_gap != twin->drive_gap) + (one->timer.gap_drive != twin->gap_drive);
    count += (one->timer.gap_coast != twin->gap_coast) + (one->timer.coast_gap != twin->coast_gap);
    count += (one->mode != twin->mode) + (one->run_mode != twin->run_mode);
    count += (one->fired != twin->fired) + (one->faults != twin->faults);
    return count + (one->started != twin->started);
}

int64_t duel_differing(size_t steps)
{
    static estimator_Self one;
    static estimator_twin twin;
    int64_t count = 0;

    estimator_Init(&one, &estimator_default_cal);
    estimator_twin_init(&twin, &twin_page);
    for (size_t step = 0U; step < steps; step++) {
        estimator_Out out;
        estimator_twin_out twin_out;

        estimator_Step(&one, &estimator_default_cal, &inputs[step], &out);
        estimator_twin_step(&twin, &twin_page, &twin_inputs[step], &twin_out);
        count += differing(&one, &twin) + apart(&out.T_hs, &twin_out.T_hs);
    }
    return count;
}

void loop_generated(size_t steps)
{
    estimator_Self one;
    estimator_Out out;

    estimator_Init(&one, &estimator_default_cal);
    for (size_t step = 0U; step < steps; step++) {
        estimator_Step(&one, &estimator_default_cal, &inputs[step], &out);
    }
}

void loop_twin(size_t steps)
{
    estimator_twin one;
    estimator_twin_out out;

    estimator_twin_init(&one, &twin_page);
    for (size_t step = 0U; step < steps; step++) {
        estimator_twin_step(&one, &twin_page, &twin_inputs[step], &out);
    }
}
