/*
 * A generated automaton and its twin by hand, on the same inputs.
 */
#ifndef DUEL_H
#define DUEL_H

#include <stddef.h>
#include <stdint.h>

#define MOST_STEPS 24000
#define MOST_INPUTS 8

/* Of one side: the inputs of a step are taken from a record */
int duel_inputs(void);
void duel_feed(const double *record, size_t step);

/* How many of the values that both carry differ in their bits after one of so many steps */
int64_t duel_differing(size_t steps);

/* All steps by one side alone, from the start */
void loop_generated(size_t steps);
void loop_twin(size_t steps);

/* Nanoseconds, or on the target instructions */
int64_t duel_clock(void);

#endif
