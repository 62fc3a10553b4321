/* The only place that knows the structure of MUMPS: a handle, and a few facts in and out. Built into
 * a shared library of its own, which linear/mumps_library.f90 loads when factors are asked for, so
 * that no other run loads MUMPS and no BLAS but that of the program itself. */
#include <stdlib.h>
#include <string.h>

#include "dmumps_c.h"

/* As type mumps_call_t in mumps_library.f90. */
typedef struct {
  void *instance;            /* between the first call and the last; null before and after */
  int *rows, *columns;       /* of the lower triangle, from 1 */
  double *values;
  double *right;             /* right sides in columns, then the solutions */
  const char *folder;        /* for factors on disk; null: in memory */
  long long n_entries;
  int n;
  int n_right;
  int spare;                 /* percent of memory beyond the estimate */
  int code, detail;          /* INFOG(1) and INFOG(2) of MUMPS, code 0 or above: success */
  int n_negative;            /* pivots */
  int n_null;                /* pivots */
  int null_unknown;          /* the first of them */
  int megabytes;             /* for factors in memory, as estimated, then as used */
  int megabytes_on_disk;     /* of memory where factors are on disk */
  double n_factor_entries;
  double n_operations;
} call_t;

enum { begin_and_analyse = 1, factorise = 2, solve = 3, end = 4 };

/* To be said before the factors are found, not before the analysis. */
static void put_factors_on_disk(DMUMPS_STRUC_C *m, const char *folder) {
  m->icntl[22 - 1] = 1;
  strncpy(m->ooc_tmpdir, folder, sizeof m->ooc_tmpdir - 1);
  strcpy(m->ooc_prefix, "igaform");
}

static void begin(DMUMPS_STRUC_C *m) {
  m->job = -1;
  m->par = 1;
  m->sym = 2;                /* with pivots of any sign */
  m->comm_fortran = -987654; /* the communicator of the sequential library */
  dmumps_c(m);
  for (int i = 0; i < 4; i++) m->icntl[i] = i < 3 ? -1 : 0; /* no words */
  m->icntl[6 - 1] = 0;       /* the analysis knows no values, so that it serves all */
  m->icntl[12 - 1] = 1;
  /* Approximate minimum fill. On sheets PORD takes as many operations, but ends the program where a
   * matrix is nearly full; SCOTCH takes more, and its random numbers depend on what came before. */
  m->icntl[7 - 1] = 2;
  m->icntl[28 - 1] = 1;      /* one process, one thread */
  m->icntl[16 - 1] = 1;
  m->icntl[24 - 1] = 1;      /* null pivots are counted and named */
  m->cntl[3 - 1] = 1.0e-12;  /* below this part of the scaled matrix a pivot is null: those of free
                              * translations are below 1e-13, those of thin sheets above 1e-11 */
}

static void take_facts(const DMUMPS_STRUC_C *m, call_t *call) {
  call->code = m->infog[1 - 1];
  call->detail = m->infog[2 - 1];
  if (m->job == 1) {
    call->megabytes = m->infog[16 - 1];
    call->megabytes_on_disk = m->infog[26 - 1];
    call->n_factor_entries = m->infog[20 - 1] < 0 ? -1.0e6 * m->infog[20 - 1] : m->infog[20 - 1];
    call->n_operations = m->rinfog[1 - 1];
  } else if (m->job == 2 && call->code >= 0) {
    call->n_negative = m->infog[12 - 1];
    call->n_null = m->infog[28 - 1];
    call->null_unknown = call->n_null > 0 ? m->pivnul_list[0] : 0;
    call->megabytes = m->infog[21 - 1];
  }
}

void igaform_mumps(int job, call_t *call) {
  DMUMPS_STRUC_C *m = call->instance;
  if (job == begin_and_analyse) {
    m = calloc(1, sizeof *m);
    call->instance = m;
    if (m == NULL) {
      call->code = -13;
      return;
    }
    begin(m);
  }
  if (job == end) {
    m->job = -2;
    dmumps_c(m);
    free(m);
    call->instance = NULL;
    return;
  }
  m->n = call->n;
  m->nnz = call->n_entries;
  m->irn = call->rows;
  m->jcn = call->columns;
  m->a = call->values;
  m->rhs = call->right;
  m->nrhs = call->n_right;
  m->lrhs = call->n;
  m->icntl[14 - 1] = call->spare;
  if (job == factorise && call->folder != NULL) put_factors_on_disk(m, call->folder);
  m->job = job;
  dmumps_c(m);
  take_facts(m, call);
}
