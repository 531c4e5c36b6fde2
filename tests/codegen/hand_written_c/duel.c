/*
 * Reads all inputs, then how often to repeat; writes how many steps there were, how many values
 * differ, and of each repetition what the generated code and the twin took.
 */
#include "duel.h"

#include <stdbool.h>

#include "harness/harness.h"

static void put(int64_t number)
{
    harness_put(&number, sizeof number);
}

int main(void)
{
    double record[MOST_INPUTS];
    double head[2];
    const size_t size = (size_t)duel_inputs() * sizeof record[0];
    size_t steps;

    if (!harness_get(head, sizeof head) || (head[0] > (double)MOST_STEPS)) {
        return 1;
    }
    steps = (size_t)head[0];
    for (size_t step = 0U; step < steps; step++) {
        if (!harness_get(record, size)) {
            return 1;
        }
        duel_feed(record, step);
    }
    put((int64_t)steps);
    put(duel_differing(steps));
    for (int round = 0; round < (int)head[1]; round++) {
        const int64_t begin = duel_clock();
        int64_t between;

        loop_generated(steps);
        between = duel_clock();
        loop_twin(steps);
        put(between - begin);
        put(duel_clock() - between);
    }
    return harness_end();
}
