/* Loaded into User Mode Linux (LD_PRELOAD): what its kernel asks of the host, changed in two places.
 *
 * Registers. User Mode Linux keeps FP_SIZE bytes of the extended state (XSAVE area). Where the processor has more, as
 * with AMX, the host's kernel refuses to set less than all of it, and User Mode Linux panics ("ptrace set fp regs
 * failed"). Here the rest is filled up with what the process has.
 *
 * Time. With VCAN_SLOWER=N the guest's clock runs N times slower than the host's: one second there is N seconds here.
 * A host that stalls for 0.5 s then stalls the guest for 0.5 s / N.
 */
#define _GNU_SOURCE
#include <dlfcn.h>
#include <elf.h>
#include <stdarg.h>
#include <stdlib.h>
#include <string.h>
#include <sys/ptrace.h>
#include <sys/uio.h>
#include <time.h>

static char all[65536]; /* 11008 bytes are used with AMX; a kernel's stack would not hold them */
static long long slower = 1;

__attribute__((constructor)) static void read_slower(void)
{
    const char *text = getenv("VCAN_SLOWER");
    if (text && atoll(text) > 1)
        slower = atoll(text);
}

long ptrace(enum __ptrace_request request, ...)
{
    static long (*real)(enum __ptrace_request, ...);
    va_list words;
    va_start(words, request);
    int pid = va_arg(words, int);
    void *address = va_arg(words, void *);
    void *data = va_arg(words, void *);
    va_end(words);
    if (!real)
        real = dlsym(RTLD_NEXT, "ptrace");
    if (request != PTRACE_SETREGSET || (unsigned long)address != NT_X86_XSTATE)
        return real(request, pid, address, data);

    struct iovec given = *(struct iovec *)data, whole = {all, sizeof all};
    if (real(PTRACE_GETREGSET, pid, address, &whole) != 0 || whole.iov_len <= given.iov_len)
        return real(request, pid, address, data);
    memcpy(all, given.iov_base, given.iov_len);
    return real(request, pid, address, &whole);
}

static struct timespec of_ns(long long ns)
{
    return (struct timespec){ns / 1000000000, ns % 1000000000};
}

static long long ns_of(struct timespec time)
{
    return time.tv_sec * 1000000000LL + time.tv_nsec;
}

int clock_gettime(clockid_t clock, struct timespec *time)
{
    static int (*real)(clockid_t, struct timespec *);
    if (!real)
        real = dlsym(RTLD_NEXT, "clock_gettime");
    int failed = real(clock, time);
    if (!failed && clock == CLOCK_MONOTONIC)
        *time = of_ns(ns_of(*time) / slower);
    return failed;
}

int timer_settime(timer_t timer, int flags, const struct itimerspec *given, struct itimerspec *before)
{
    static int (*real)(timer_t, int, const struct itimerspec *, struct itimerspec *);
    if (!real)
        real = dlsym(RTLD_NEXT, "timer_settime");
    struct itimerspec longer = {of_ns(ns_of(given->it_interval) * slower), of_ns(ns_of(given->it_value) * slower)};
    int failed = real(timer, flags, &longer, before);
    if (!failed && before)
        *before = (struct itimerspec){of_ns(ns_of(before->it_interval) / slower), of_ns(ns_of(before->it_value) / slower)};
    return failed;
}

int timer_gettime(timer_t timer, struct itimerspec *left)
{
    static int (*real)(timer_t, struct itimerspec *);
    if (!real)
        real = dlsym(RTLD_NEXT, "timer_gettime");
    int failed = real(timer, left);
    if (!failed)
        *left = (struct itimerspec){of_ns(ns_of(left->it_interval) / slower), of_ns(ns_of(left->it_value) / slower)};
    return failed;
}
