/*
 * Instructions so far, by the system timer of a Cortex-M4F at 25 MHz: where the emulator lets one
 * instruction take 1 ns (-icount shift=0) it ticks once in 40. Ask more often than each 2^24 ticks.
 */
#include "instructions.h"

#define CONTROL (*(volatile uint32_t *)0xE000E010UL)
#define RELOAD (*(volatile uint32_t *)0xE000E014UL)
#define CURRENT (*(volatile uint32_t *)0xE000E018UL)
#define WHOLE 0x00FFFFFFUL
#define ENABLED 5UL

int64_t instructions(void)
{
    static uint32_t last;
    static int64_t ticks;

    if ((CONTROL & 1UL) == 0UL) {
        RELOAD = WHOLE;
        CURRENT = 0UL;
        CONTROL = ENABLED;
        last = CURRENT;
    }
    ticks += (last - CURRENT) & WHOLE;
    last = CURRENT;
    return ticks * INSTRUCTIONS_PER_TICK;
}
