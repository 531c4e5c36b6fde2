/*
 * Where a harness reads its records from and writes them to: one of stdio.c and semihosting.c.
 */
#ifndef HARNESS_H
#define HARNESS_H

#include <stdbool.h>
#include <stddef.h>

/* Reads so many bytes; false where there are none left, or fewer */
bool harness_get(void *record, size_t size);

/* Writes so many bytes; ends the program where that fails */
void harness_put(const void *record, size_t size);

/* The end: returns 0 where everything was read and written */
int harness_end(void);

#endif
