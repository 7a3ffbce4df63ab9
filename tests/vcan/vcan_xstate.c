/* Loaded into User Mode Linux (LD_PRELOAD): sets the floating-point registers of a traced process on processors with AMX.
 *
 * User Mode Linux keeps FP_SIZE bytes of the extended state (XSAVE area). Where the processor has more, as with AMX, the
 * host's kernel refuses to set less than all of it, and User Mode Linux panics ("ptrace set fp regs failed"). Here the
 * rest is filled up with what the process has.
 */
#define _GNU_SOURCE
#include <dlfcn.h>
#include <elf.h>
#include <stdarg.h>
#include <string.h>
#include <sys/ptrace.h>
#include <sys/uio.h>

static char all[65536]; /* 11008 bytes are used with AMX; a kernel's stack would not hold them */

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
