/* The name that a routine written in C has for Fortran, for #include in subroutines of users. */
#ifndef IGAFORM_ABA_FOR_C
#define IGAFORM_ABA_FOR_C
#define FOR_NAME(lower, upper) lower##_
#endif
