!> The subroutines of users as they are called: names, orders and kinds of their arguments. The
!! length of CMNAME comes last and by value, as gfortran passes it behind the argument list.
module umat_interface
  use, intrinsic :: iso_c_binding, only: c_char, c_double, c_int, c_size_t
  implicit none
  private

  public :: umat_procedure, vumat_procedure, sdvini_procedure, name_length
  public :: uexternaldb_procedure, vexternaldb_procedure

  integer, parameter :: name_length = 80   !! of CMNAME

  abstract interface
    !> Arguments of a UMAT in the order of Abaqus/Standard. KSTEP has four entries for sources
    !! that call it JSTEP(4).
    subroutine umat_procedure(stress, statev, ddsdde, sse, spd, scd, rpl, ddsddt, drplde, &
                              drpldt, stran, dstran, time, dtime, temp, dtemp, predef, dpred, &
                              cmname, ndi, nshr, ntens, nstatv, props, nprops, coords, drot, &
                              pnewdt, celent, dfgrd0, dfgrd1, noel, npt, layer, kspt, kstep, &
                              kinc, cmname_length) bind(C)
      import :: c_char, c_double, c_int, c_size_t, name_length
      integer(c_int), intent(in) :: ndi, nshr, ntens, nstatv, nprops
      integer(c_int), intent(in) :: noel, npt, layer, kspt, kstep(4), kinc
      character(kind=c_char), intent(in) :: cmname(name_length)
      real(c_double), intent(inout) :: stress(ntens), statev(*), ddsdde(ntens, ntens)
      real(c_double), intent(inout) :: sse, spd, scd, rpl, ddsddt(ntens), drplde(ntens), drpldt
      real(c_double), intent(inout) :: pnewdt
      real(c_double), intent(in) :: stran(ntens), dstran(ntens), time(2), dtime, temp, dtemp
      real(c_double), intent(in) :: predef(*), dpred(*), props(*), coords(3), drot(3, 3)
      real(c_double), intent(in) :: celent, dfgrd0(3, 3), dfgrd1(3, 3)
      integer(c_size_t), value :: cmname_length
    end subroutine umat_procedure

    !> Arguments of a VUMAT in the order of Abaqus/Explicit. One call serves the old signature
    !! (NBLOCK, LANNEAL, DT), the new one (jInfoArray, dtArray) and wrappers that take JBLOCK.
    subroutine vumat_procedure(jblock, ndir, nshr, nstatev, nfieldv, nprops, jinfo, step_time, &
                               total_time, dt_array, cmname, coord, char_length, props, density, &
                               strain_inc, rel_spin_inc, temp_old, stretch_old, defgrad_old, &
                               field_old, stress_old, state_old, ener_old, inelastic_old, &
                               temp_new, stretch_new, defgrad_new, field_new, stress_new, &
                               state_new, ener_new, inelastic_new, cmname_length) bind(C)
      import :: c_char, c_double, c_int, c_size_t, name_length
      integer(c_int), intent(in) :: jblock(*), ndir, nshr, nstatev, nfieldv, nprops, jinfo(*)
      real(c_double), intent(in) :: step_time, total_time, dt_array(*), coord(*), char_length(*)
      character(kind=c_char), intent(in) :: cmname(name_length)
      real(c_double), intent(in) :: props(*), density(*), strain_inc(*), rel_spin_inc(*)
      real(c_double), intent(in) :: temp_old(*), stretch_old(*), defgrad_old(*), field_old(*)
      real(c_double), intent(in) :: stress_old(*), state_old(*), ener_old(*), inelastic_old(*)
      real(c_double), intent(inout) :: temp_new(*), stretch_new(*), defgrad_new(*), field_new(*)
      real(c_double), intent(inout) :: stress_new(*), state_new(*), ener_new(*), inelastic_new(*)
      integer(c_size_t), value :: cmname_length
    end subroutine vumat_procedure

    !> State variables at the start.
    subroutine sdvini_procedure(statev, coords, nstatv, ncrds, noel, npt, layer, kspt) bind(C)
      import :: c_double, c_int
      integer(c_int), intent(in) :: nstatv, ncrds, noel, npt, layer, kspt
      real(c_double), intent(inout) :: statev(*)
      real(c_double), intent(in) :: coords(3)
    end subroutine sdvini_procedure

    !> What a UMAT keeps beside its state variables. LOP = 0: the analysis starts.
    subroutine uexternaldb_procedure(lop, lrestart, time, dtime, kstep, kinc) bind(C)
      import :: c_double, c_int
      integer(c_int), intent(in) :: lop, lrestart, kstep, kinc
      real(c_double), intent(in) :: time(2), dtime
    end subroutine uexternaldb_procedure

    !> The same for a VUMAT.
    subroutine vexternaldb_procedure(lop, i_array, ni_array, r_array, nr_array) bind(C)
      import :: c_double, c_int
      integer(c_int), intent(in) :: lop, i_array(*), ni_array, nr_array
      real(c_double), intent(in) :: r_array(*)
    end subroutine vexternaldb_procedure
  end interface

end module umat_interface
