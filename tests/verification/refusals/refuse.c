/* Refuses what a program asks of the system, for tests: loaded before it by LD_PRELOAD.

   REFUSE=KIND:N lets the N-th call of a kind fail, REFUSE=KIND:N+ that one and all behind it. Kinds:
   memory (malloc, calloc, realloc of REFUSE_BYTES bytes and more), write (to plain files, and their
   new lengths), flush, rename and share (memory that processes share). At the end the numbers of calls are added to the file
   REFUSE_COUNTS, a line for each kind. */
#define _GNU_SOURCE
#include <dlfcn.h>
#include <errno.h>
#include <fcntl.h>
#include <stdatomic.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/mman.h>
#include <sys/stat.h>
#include <sys/syscall.h>
#include <sys/uio.h>
#include <unistd.h>

enum kind { MEMORY, WRITE, FLUSH, RENAME, SHARE, N_KINDS };

static const char *const names[N_KINDS] = {"memory", "write", "flush", "rename", "share"};
static atomic_long counts[N_KINDS];
static int refused_kind = -1, is_lasting;
static long refused_call;
static size_t least_bytes = 4096;

/* What the C library's own entries are called, which no other library stands in for. */
extern void *__libc_malloc(size_t n);
extern void *__libc_calloc(size_t n, size_t size);
extern void *__libc_realloc(void *old, size_t n);

__attribute__((constructor)) static void read_wishes(void) {
  const char *wish = getenv("REFUSE"), *bytes = getenv("REFUSE_BYTES");
  const char *colon = wish ? strchr(wish, ':') : NULL;
  if (bytes) least_bytes = strtoul(bytes, NULL, 10);
  if (!colon) return;
  for (int k = 0; k < N_KINDS; k++)
    if (!strncmp(wish, names[k], (size_t)(colon - wish))) refused_kind = k;
  refused_call = strtol(colon + 1, NULL, 10);
  is_lasting = wish[strlen(wish) - 1] == '+';
}

__attribute__((destructor)) static void write_counts(void) {
  const char *path = getenv("REFUSE_COUNTS");
  char text[200];
  int n = 0, file;
  ssize_t written;
  if (!path) return;
  for (int k = 0; k < N_KINDS; k++)
    n += snprintf(text + n, sizeof text - (size_t)n, "%s %ld\n", names[k], (long)counts[k]);
  file = open(path, O_WRONLY | O_CREAT | O_TRUNC, 0600);
  if (file < 0) return;
  refused_kind = -1;
  written = write(file, text, (size_t)n);
  (void)written;
  close(file);
}

/* Is this call to fail? */
static int is_refused(enum kind kind) {
  long call = 1 + atomic_fetch_add(&counts[kind], 1);
  if (kind != (enum kind)refused_kind) return 0;
  return call == refused_call || (is_lasting && call > refused_call);
}

static int is_plain_file(int file) {
  struct stat facts;
  return fstat(file, &facts) == 0 && S_ISREG(facts.st_mode);
}

static void *next(const char *name) { return dlsym(RTLD_NEXT, name); }

void *malloc(size_t n) {
  if (n >= least_bytes && is_refused(MEMORY)) {
    errno = ENOMEM;
    return NULL;
  }
  return __libc_malloc(n);
}

void *calloc(size_t n, size_t size) {
  if (size && n >= (least_bytes + size - 1) / size && is_refused(MEMORY)) {
    errno = ENOMEM;
    return NULL;
  }
  return __libc_calloc(n, size);
}

void *realloc(void *old, size_t n) {
  if (n >= least_bytes && is_refused(MEMORY)) {
    errno = ENOMEM;
    return NULL;
  }
  return __libc_realloc(old, n);
}

void *mmap(void *place, size_t n, int access, int flags, int file, off_t offset) {
  if ((flags & MAP_SHARED) && (flags & MAP_ANONYMOUS) && is_refused(SHARE)) {
    errno = ENOMEM;
    return MAP_FAILED;
  }
  return (void *)syscall(SYS_mmap, place, n, access, flags, file, offset);
}

#define FAIL_IF_REFUSED(kind, file, code)           \
  if (is_plain_file(file) && is_refused(kind)) {    \
    errno = code;                                   \
    return -1;                                      \
  }

ssize_t write(int file, const void *bytes, size_t n) {
  static ssize_t (*real)(int, const void *, size_t);
  FAIL_IF_REFUSED(WRITE, file, ENOSPC)
  if (!real) *(void **)&real = next("write");
  return real(file, bytes, n);
}

ssize_t writev(int file, const struct iovec *parts, int n) {
  static ssize_t (*real)(int, const struct iovec *, int);
  FAIL_IF_REFUSED(WRITE, file, ENOSPC)
  if (!real) *(void **)&real = next("writev");
  return real(file, parts, n);
}

ssize_t pwrite(int file, const void *bytes, size_t n, off_t place) {
  static ssize_t (*real)(int, const void *, size_t, off_t);
  FAIL_IF_REFUSED(WRITE, file, ENOSPC)
  if (!real) *(void **)&real = next("pwrite");
  return real(file, bytes, n, place);
}

ssize_t pwrite64(int file, const void *bytes, size_t n, off64_t place) {
  static ssize_t (*real)(int, const void *, size_t, off64_t);
  FAIL_IF_REFUSED(WRITE, file, ENOSPC)
  if (!real) *(void **)&real = next("pwrite64");
  return real(file, bytes, n, place);
}

int ftruncate(int file, off_t length) {
  static int (*real)(int, off_t);
  FAIL_IF_REFUSED(WRITE, file, ENOSPC)
  if (!real) *(void **)&real = next("ftruncate");
  return real(file, length);
}

int ftruncate64(int file, off64_t length) {
  static int (*real)(int, off64_t);
  FAIL_IF_REFUSED(WRITE, file, ENOSPC)
  if (!real) *(void **)&real = next("ftruncate64");
  return real(file, length);
}

int fsync(int file) {
  static int (*real)(int);
  FAIL_IF_REFUSED(FLUSH, file, EIO)
  if (!real) *(void **)&real = next("fsync");
  return real(file);
}

int fdatasync(int file) {
  static int (*real)(int);
  FAIL_IF_REFUSED(FLUSH, file, EIO)
  if (!real) *(void **)&real = next("fdatasync");
  return real(file);
}

int rename(const char *from, const char *to) {
  static int (*real)(const char *, const char *);
  if (is_refused(RENAME)) {
    errno = EACCES;
    return -1;
  }
  if (!real) *(void **)&real = next("rename");
  return real(from, to);
}
