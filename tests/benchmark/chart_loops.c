/* The sides in C of the benchmark of a chart: many ticks of each, transitions counted. */
#define _GNU_SOURCE
#define main mode_switch_alone
#include "peers/mode_switch.c"
#undef main
#include "mode_switch.h"
#include "mode_switch_held.c"

long loop_by_hand(const float *theta, const float *torque, int ticks);
long loop_by_hand_held(const float *theta, const float *torque, int ticks);
long loop_generated(const mode_switch_In *inputs, int ticks);

long loop_by_hand(const float *theta, const float *torque, int ticks)
{
    B chart = {GAP, 0, 0};
    long fired = 0;

    for (int k = 0; k < ticks; k++) {
        mode_t_ before = chart.m;
        step(&chart, theta[k], torque[k]);
        fired += before != chart.m;
    }
    return fired;
}

long loop_by_hand_held(const float *theta, const float *torque, int ticks)
{
    Held chart = {GAP, 0, 0, 0};
    long fired = 0;

    for (int k = 0; k < ticks; k++) {
        mode_t_ before = chart.mode;
        step_held(&chart, theta[k], torque[k]);
        fired += before != chart.mode;
    }
    return fired;
}

long loop_generated(const mode_switch_In *inputs, int ticks)
{
    mode_switch_Self chart;
    mode_switch_Out out;
    long fired = 0;

    mode_switch_Init(&chart, &mode_switch_default_cal);
    for (int k = 0; k < ticks; k++) {
        mode_switch_Step(&chart, &mode_switch_default_cal, &inputs[k], &out);
        fired += chart.fired != 0U;
    }
    return fired;
}
