/*
 * Records from standard input to standard output.
 */
#include "harness.h"

#include <stdio.h>
#include <stdlib.h>

bool harness_get(void *record, size_t size)
{
    return fread(record, size, 1U, stdin) == 1U;
}

void harness_put(const void *record, size_t size)
{
    if (fwrite(record, size, 1U, stdout) != 1U) {
        exit(EXIT_FAILURE);
    }
}

int harness_end(void)
{
    return ((ferror(stdin) != 0) || (fflush(stdout) != 0)) ? EXIT_FAILURE : EXIT_SUCCESS;
}
