/*
 * What the start-up code of a bare Cortex-M4F asks of the code that talks to the host.
 */
#ifndef CORTEX_M4F_H
#define CORTEX_M4F_H

void open_records(void);

/* Ends the program with an exit code of the host */
void leave(int code) __attribute__((noreturn));

#endif
