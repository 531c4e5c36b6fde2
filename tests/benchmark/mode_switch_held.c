/* The chart of peers/mode_switch.c as one would write it with inputs held in ranges, faults latched. */
#include <math.h>

typedef struct {
    mode_t_ mode;
    int candidate;
    int count;
    unsigned faults;
} Held;

static float nearest(float value, float low, float high)
{
    return value > low ? (value < high ? value : high) : low;
}

__attribute__((noinline)) static void step_held(Held *chart, float theta, float torque)
{
    if (!(fabsf(theta) <= 1.0f)) {
        chart->faults |= 1u;
        theta = nearest(theta, -1.0f, 1.0f);
    }
    if (!(fabsf(torque) <= 400.0f)) {
        chart->faults |= 2u;
        torque = nearest(torque, -400.0f, 400.0f);
    }
    switch (chart->mode) {
    case DRIVE:
        if (torque < -1.0f) {
            chart->mode = GAP;
            chart->candidate = 0;
        }
        break;
    case COAST:
        if (torque > 1.0f) {
            chart->mode = GAP;
            chart->candidate = 0;
        }
        break;
    default: {
        int candidate = theta >= 0.02f ? 1 : theta <= -0.02f ? 2 : 0;
        if (candidate != chart->candidate) {
            chart->candidate = candidate;
            chart->count = 0;
        } else {
            chart->count++;
        }
        if (candidate && chart->count >= 5) {
            chart->mode = (mode_t_)candidate;
            chart->candidate = 0;
        }
    }
    }
}
