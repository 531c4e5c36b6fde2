#include <string.h>

#include "driveline.h"
#include "duel.h"
#include "plant_twin.h"

static driveline_In inputs[MOST_STEPS];
static plant_twin_in twin_inputs[MOST_STEPS];
static const plant_twin_cal twin_page = {0.05F};

int duel_inputs(void)
{
    return 3;
}

void duel_feed(const double *record, size_t step)
{
    const driveline_In in = {
        .T_em = (float)record[0], .T_br = (float)record[1], .slope = (float)record[2]};
    const plant_twin_in twin = {.T_em = in.T_em, .T_br = in.T_br, .slope = in.slope};

    inputs[step] = in;
    twin_inputs[step] = twin;
}

static int64_t apart(const float *a, const float *b)
{
    return memcmp(a, b, sizeof *a) != 0;
}

static int64_t differing(const driveline_Self *one, const plant_twin *twin)
{
    int64_t count = apart(&one->state.w_w, &twin->w_w) + apart(&one->state.w_em, &twin->w_em);

    count += apart(&one->state.theta_d, &twin->theta_d);
    count += apart(&one->state.theta_b, &twin->theta_b) + apart(&one->equation.w_d, &twin->w_d);
    count += apart(&one->equation.w_free, &twin->w_free);
    count += apart(&one->equation.T_hs, &twin->T_hs) + apart(&one->equation.T_aer, &twin->T_aer);
    count += apart(&one->equation.T_rr, &twin->T_rr) + apart(&one->equation.T_v, &twin->T_v);
    count += apart(&one->equation.w_b, &twin->w_b);
    count += apart(&one->before.T_em, &twin->before_T_em);
    count += apart(&one->before.T_br, &twin->before_T_br);
    count += apart(&one->before.slope, &twin->before_slope);
    count += apart(&one->time, &twin->time);
    count += (one->armed_0 != twin->armed_0) + (one->armed_1 != twin->armed_1);
    count += (one->mode != twin->mode) + (one->fired != twin->fired);
    return count + (one->faults != twin->faults) + (one->started != twin->started);
}

int64_t duel_differing(size_t steps)
{
    static driveline_Self one;
    static plant_twin twin;
    int64_t count = 0;

    driveline_Init(&one, &driveline_default_cal);
    plant_twin_init(&twin, &twin_page);
    for (size_t step = 0U; step < steps; step++) {
        driveline_Out out;
        plant_twin_out twin_out;

        driveline_Step(&one, &driveline_default_cal, &inputs[step], &out);
        plant_twin_step(&twin, &twin_page, &twin_inputs[step], &twin_out);
        count += differing(&one, &twin) + apart(&out.T_hs, &twin_out.T_hs);
    }
    return count;
}

void loop_generated(size_t steps)
{
    driveline_Self one;
    driveline_Out out;

    driveline_Init(&one, &driveline_default_cal);
    for (size_t step = 0U; step < steps; step++) {
        driveline_Step(&one, &driveline_default_cal, &inputs[step], &out);
    }
}

void loop_twin(size_t steps)
{
    plant_twin one;
    plant_twin_out out;

    plant_twin_init(&one, &twin_page);
    for (size_t step = 0U; step < steps; step++) {
        plant_twin_step(&one, &twin_page, &twin_inputs[step], &out);
    }
}
