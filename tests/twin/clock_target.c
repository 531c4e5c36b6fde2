/*
 * The system timer of a Cortex-M4F at 25 MHz, where the emulator counts one instruction as 1 ns:
 * 40 instructions a tick. A loop must take fewer than 2^24 ticks.
 */
#include "duel.h"

#define CONTROL (*(volatile uint32_t *)0xE000E010UL)
#define RELOAD (*(volatile uint32_t *)0xE000E014UL)
#define CURRENT (*(volatile uint32_t *)0xE000E018UL)
#define INSTRUCTIONS_PER_TICK 40

int64_t duel_clock(void)
{
    static uint32_t last;
    static int64_t ticks;

    if ((CONTROL & 1UL) == 0UL) {
        RELOAD = 0x00FFFFFFUL;
        CURRENT = 0UL;
        CONTROL = 5UL;
        last = CURRENT;
    }
    ticks += (last - CURRENT) & 0x00FFFFFFUL;
    last = CURRENT;
    return ticks * INSTRUCTIONS_PER_TICK;
}
