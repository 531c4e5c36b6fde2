#define _POSIX_C_SOURCE 199309L
#include <time.h>

#include "duel.h"

int64_t duel_clock(void)
{
    struct timespec now;

    (void)clock_gettime(CLOCK_MONOTONIC, &now);
    return ((int64_t)now.tv_sec * 1000000000) + now.tv_nsec;
}
