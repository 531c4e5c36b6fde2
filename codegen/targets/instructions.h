/*
 * How many instructions were executed on an emulated target.
 */
#ifndef INSTRUCTIONS_H
#define INSTRUCTIONS_H

#include <stdint.h>

#define INSTRUCTIONS_PER_TICK 40

/* Instructions since the first call, in whole ticks */
int64_t instructions(void);

#endif
