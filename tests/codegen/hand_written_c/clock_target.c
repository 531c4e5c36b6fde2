#include "duel.h"
#include "harness/instructions.h"

int64_t duel_clock(void)
{
    return instructions();
}
