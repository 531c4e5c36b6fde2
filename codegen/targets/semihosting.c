/*
 * Records from the file records.in of the host to its file records.out, by semihosting (Semihosting
 * for AArch32 and AArch64, Arm 2024).
 */
#include "harness.h"

#include <stdint.h>
#include <string.h>

#include "cortex_m4f.h"

#define ROOM 65536U

enum { OPEN = 0x01, CLOSE = 0x02, WRITE = 0x05, READ = 0x06, EXIT = 0x20 };
enum { READ_BINARY = 1, WRITE_BINARY = 5 };
#define APPLICATION_EXIT 0x20026U

static unsigned char read_ahead[ROOM];
static unsigned char written[ROOM];
static size_t at, known, kept;
static uint32_t from, to;

static uint32_t ask_host(uint32_t operation, const uint32_t *arguments)
{
    register uint32_t r0 __asm__("r0") = operation;
    register const uint32_t *r1 __asm__("r1") = arguments;

    __asm__ volatile("bkpt 0xAB" : "+r"(r0) : "r"(r1) : "memory");
    return r0;
}

static uint32_t open_file(const char *name, uint32_t mode)
{
    const uint32_t arguments[] = {(uint32_t)name, mode, (uint32_t)strlen(name)};
    const uint32_t handle = ask_host(OPEN, arguments);

    if (handle == UINT32_MAX) {
        leave(3);
    }
    return handle;
}

static void flush(void)
{
    const uint32_t arguments[] = {to, (uint32_t)written, kept};

    if ((kept > 0U) && (ask_host(WRITE, arguments) != 0U)) {
        leave(4);
    }
    kept = 0U;
}

void open_records(void)
{
    from = open_file("records.in", READ_BINARY);
    to = open_file("records.out", WRITE_BINARY);
}

void leave(int code)
{
    const uint32_t arguments[] = {APPLICATION_EXIT, (uint32_t)code};

    (void)ask_host(EXIT, arguments);
    for (;;) {
    }
}

bool harness_get(void *record, size_t size)
{
    unsigned char *const bytes = record;
    size_t found = 0U;

    while (found < size) {
        if (at == known) {
            const uint32_t arguments[] = {from, (uint32_t)read_ahead, ROOM};

            known = ROOM - ask_host(READ, arguments);
            at = 0U;
            if (known == 0U) {
                return false;
            }
        }
        bytes[found] = read_ahead[at];
        found++;
        at++;
    }
    return true;
}

void harness_put(const void *record, size_t size)
{
    if (size > (ROOM - kept)) {
        flush();
    }
    (void)memcpy(&written[kept], record, size);
    kept += size;
}

int harness_end(void)
{
    const uint32_t closed[] = {to};

    flush();
    return (ask_host(CLOSE, closed) == 0U) ? 0 : 5;
}
