/*
 * Start-up of a bare Cortex-M4F: vectors, floating-point unit in IEEE 754 mode, main.
 */
#include <stdint.h>

#include "cortex_m4f.h"

#define CPACR (*(volatile uint32_t *)0xE000ED88UL) /* access to coprocessors */
#define FPDSCR (*(volatile uint32_t *)0xE000EF3CUL) /* mode that exceptions begin with */
#define FULL_ACCESS_TO_FPU (0xFUL << 20)
#define MODE_BITS 0x07C00000UL /* AHP, DN, FZ, RMode */

extern uint32_t stack_top[];
extern uint32_t bss_start[];
extern uint32_t bss_end[];
int main(void);
void reset(void);
void fault(void);

struct vectors {
    uint32_t *stack;
    void (*handlers[15])(void);
};

extern const struct vectors vectors;
const struct vectors vectors __attribute__((section(".vectors"), used)) = {
    stack_top,
    {reset, fault, fault, fault, fault, fault},
};

void reset(void)
{
    uint32_t mode = 0U;

    CPACR |= FULL_ACCESS_TO_FPU;
    __asm__ volatile("dsb\n\tisb" ::: "memory");
    FPDSCR = 0U;
    __asm__ volatile("vmsr fpscr, %0" ::"r"(mode));
    for (uint32_t *word = bss_start; word < bss_end; word++) {
        *word = 0U;
    }
    __asm__ volatile("vmrs %0, fpscr" : "=r"(mode));
    if (((mode | FPDSCR) & MODE_BITS) != 0U) {
        leave(6);
    }
    open_records();
    leave(main());
}

void fault(void)
{
    leave(7);
}
