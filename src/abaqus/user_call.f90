!> What all laws of users have in common: the interfaces of the subroutines, name and constants with
!! spare room after them, and the record of the current element and point.
!!
!! The length of CMNAME comes last in an interface and by value, as gfortran passes it.
module user_call
  use, intrinsic :: ieee_arithmetic, only: ieee_value, ieee_quiet_nan, ieee_is_finite
  use, intrinsic :: iso_c_binding, only: c_char, c_double, c_int, c_size_t
  use kinds, only: wp
  use text, only: upper_case, to_text, joined, strings, counted
  use block_law, only: block_law_t, search_in_context
  use plane_stress, only: in_sheet
  use user_sheet, only: angle_in_sheet, find_axes, turn_into_axes, turn_out_of_axes
  use point_context, only: point_context_t, new_point_context
  use child_process, only: c_text
  use user_watch, only: enter_user_call, leave_user_call, watch_user_calls, expect_elements, &
                        forget_thread, note_failure, take_failure, note_log, log_error, at_stop, &
                        end_by_overrun, end_by_problem, offer_values
  implicit none
  private

  public :: umat_procedure, vumat_procedure, sdvini_procedure, uexternaldb_procedure
  public :: vexternaldb_procedure, usdfld_procedure, vusdfld_procedure, uvarm_procedure
  public :: set_user_heating, set_user_fields, set_user_sheet, offer_values
  public :: user_law_t, set_user_law, enter_user_call, leave_user_call, watch_user_calls
  public :: expect_elements, forget_thread, call_sdvini, note_failure, take_user_failure
  public :: set_guard, check_guard, check_spare_states, end_user_run, uneven_stiffness
  public :: moduli_of, plane_moduli_of
  public :: note_log, log_error, at_stop

  integer, parameter, public :: name_length = 80   !! of CMNAME

  !> Some sources read beyond their PROPS and STATEV: there are zeros after both.
  integer, parameter, public :: slack = 64

  !> A mark of this length follows arguments: who overwrites it has overwritten more.
  integer, parameter, public :: n_guard = 8
  real(wp), parameter, public :: mark = -7.0e-211_wp

  !> Values after the last mark that nobody uses, for writes that continue beyond it.
  integer, parameter, public :: n_room = 4096

  !> Routines of users, as `enter_user_call` takes them.
  integer(c_int), parameter, public :: in_umat = 1, in_vumat = 2, in_sdvini = 3, &
                                       in_uexternaldb = 4, in_vexternaldb = 5, in_usdfld = 6, &
                                       in_vusdfld = 7, in_uvarm = 8

  !> What a UMAT does whose PNEWDT stays below one.
  character(*), parameter, public :: refusal_words = &
    "UMAT asks for a smaller increment by PNEWDT, even in 64 parts,"

  !> What a law of solids needs that was called in the form for shells.
  character(*), parameter, public :: space_words = &
    "a law for solids needs STRESS STATE=THREE DIMENSIONAL of *USER MATERIAL"

  !> Field variables in addition to the temperature at most: PREDEF, FIELDOLD.
  integer, parameter, public :: most_fields = 20

  !> A law of a user with its constants and its name.
  type, abstract, extends(block_law_t) :: user_law_t
    character(kind=c_char) :: name(name_length) = " "   !! CMNAME, upper case
    integer :: n_props = 0                              !! NPROPS
    integer :: n_statv = 0                              !! NSTATV: the first of `n_state`
    integer :: n_uvarm = 0                              !! NUVARM: they follow
    integer :: n_own_fields = 0                         !! field variables of the user, of which
                                                        !! the last values come next
    integer :: n_before = 0                             !! all these; what the adapter keeps follows
    integer :: n_direct = 3, n_shear = 3                !! stresses in a call: NDI, NSHR
    logical :: is_plane = .false.                       !! it is called in its form for shells
    integer :: angle_state = 0                          !! the kept value that is the angle of its
                                                        !! axis 1 in the frame of a sheet, 0: solid
    real(wp), allocatable :: props(:)                   !! PROPS and zeros after them
    logical :: has_moduli = .false.                     !! of *ELASTIC: no call before the run
    integer :: heat_state = 0                           !! the kept value that is the temperature
                                                        !! rise by inelastic work, 0: none
    real(wp) :: heat_per_work = 0.0_wp                  !! that rise by work per volume
    real(wp) :: start_temperature = 0.0_wp              !! where the deck gives no other
    procedure(sdvini_procedure), pointer, nopass :: sdvini => null()
    procedure(usdfld_procedure), pointer, nopass :: usdfld => null()
    procedure(vusdfld_procedure), pointer, nopass :: vusdfld => null()
    procedure(uvarm_procedure), pointer, nopass :: uvarm => null()
    character(40) :: stiffness_source = ""              !! of `stiffness_at_start`, for messages
  contains
    procedure :: update
    procedure :: lay_in_sheet
    procedure :: update_plane_in_context
    procedure(update_sheet), deferred :: update_in_axes
    procedure(find_stiffness), deferred :: stiffness_at_start
  end type user_law_t

  !> The point for which a user's subroutine is asked for its stiffness before the run.
  type, public :: first_point_t
    integer :: element = 1, point = 1     !! NOEL, NPT
    real(wp) :: place(3) = 0.0_wp         !! COORDS
    real(wp) :: length = 1.0_wp           !! CELENT
    integer :: n_fields = 0               !! temperature and field variables given
    real(wp) :: fields(most_fields + 1) = 0.0_wp   !! these
  end type first_point_t

  abstract interface
    !> Stiffness against each component of strain, from one call of the user's subroutine.
    subroutine find_stiffness(self, dt, point, state, stiffness, is_finite)
      import :: user_law_t, first_point_t, wp
      class(user_law_t), intent(in) :: self
      real(wp), intent(in) :: dt                 !! a short increment
      type(first_point_t), intent(in) :: point
      real(wp), intent(in) :: state(:)           !! STATEV at the start
      real(wp), intent(out) :: stiffness(6)      !! 11 22 33 12 13 23, for engineering shear
      logical, intent(out) :: is_finite          !! all that was returned is
    end subroutine find_stiffness

    !> Update of a law in its form for shells: stress and strain in the axes of the material.
    subroutine update_sheet(self, context, dt, dstrain, stress, state, through, ok, spin)
      import :: user_law_t, point_context_t, wp
      class(user_law_t), intent(in) :: self
      type(point_context_t), intent(in) :: context
      real(wp), intent(in) :: dt, dstrain(context%n, 3)      !! 11 22 12, engineering shear
      real(wp), intent(inout) :: stress(context%n, 3), state(context%n, self%n_state)
      real(wp), intent(out) :: through(context%n)            !! strain increment 33
      logical, intent(out) :: ok
      real(wp), intent(in) :: spin(context%n)                !! against the axes, 12
    end subroutine update_sheet

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

    !> Field variables of a point, from those of the deck; state variables may change, too.
    subroutine usdfld_procedure(field, statev, pnewdt, direct, t, celent, time, dtime, cmname, &
                                orname, nfield, nstatv, noel, npt, layer, kspt, kstep, kinc, ndi, &
                                nshr, coord, jmac, jmatyp, matlayo, laccfla, cmname_length, &
                                orname_length) bind(C)
      import :: c_char, c_double, c_int, c_size_t, name_length
      integer(c_int), intent(in) :: nfield, nstatv, noel, npt, layer, kspt, kstep(4), kinc
      integer(c_int), intent(in) :: ndi, nshr, jmac(*), jmatyp(*), matlayo, laccfla
      real(c_double), intent(inout) :: field(*), statev(*), pnewdt
      real(c_double), intent(in) :: direct(3, 3), t(3, 3), celent, time(2), dtime, coord(3)
      character(kind=c_char), intent(in) :: cmname(name_length), orname(name_length)
      integer(c_size_t), value :: cmname_length, orname_length
    end subroutine usdfld_procedure

    !> The same for a block of points before a VUMAT.
    subroutine vusdfld_procedure(nblock, nstatev, nfieldv, nprops, ndir, nshr, jelemuid, kintpt, &
                                 klayer, ksecpt, step_time, total_time, dt, cmname, coord, direct, &
                                 t, char_length, props, state_old, state_new, field, &
                                 cmname_length) bind(C)
      import :: c_char, c_double, c_int, c_size_t, name_length
      integer(c_int), intent(in) :: nblock, nstatev, nfieldv, nprops, ndir, nshr, jelemuid(*)
      integer(c_int), intent(in) :: kintpt, klayer, ksecpt
      real(c_double), intent(in) :: step_time, total_time, dt, coord(*), direct(*), t(*)
      real(c_double), intent(in) :: char_length(*), props(*)
      character(kind=c_char), intent(in) :: cmname(name_length)
      real(c_double), intent(inout) :: state_old(*), state_new(*), field(*)
      integer(c_size_t), value :: cmname_length
    end subroutine vusdfld_procedure

    !> Output variables of a point at the end of an increment.
    subroutine uvarm_procedure(uvar, direct, t, time, dtime, cmname, orname, nuvarm, noel, npt, &
                               layer, kspt, kstep, kinc, ndi, nshr, coord, jmac, jmatyp, matlayo, &
                               laccfla, cmname_length, orname_length) bind(C)
      import :: c_char, c_double, c_int, c_size_t, name_length
      integer(c_int), intent(in) :: nuvarm, noel, npt, layer, kspt, kstep(4), kinc
      integer(c_int), intent(in) :: ndi, nshr, jmac(*), jmatyp(*), matlayo, laccfla
      real(c_double), intent(inout) :: uvar(*)
      real(c_double), intent(in) :: direct(3, 3), t(3, 3), time(2), dtime, coord(3)
      character(kind=c_char), intent(in) :: cmname(name_length), orname(name_length)
      integer(c_size_t), value :: cmname_length, orname_length
    end subroutine uvarm_procedure

    !> What a UMAT keeps in addition to its state variables. LOP = 0: the analysis starts.
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

contains

  !> Set what laws of users have in common.
  subroutine set_user_law(law, name, density, props, n_statv, n_kept)
    class(user_law_t), intent(inout) :: law
    character(*), intent(in) :: name   !! CMNAME
    real(wp), intent(in) :: density, props(:)
    integer, intent(in) :: n_statv     !! NSTATV, of a VUMAT NSTATEV
    integer, intent(in) :: n_kept      !! values kept after the state variables
    character(name_length) :: padded
    integer :: i

    padded = upper_case(name)
    do i = 1, name_length
      law%name(i) = padded(i:i)
    end do
    law%density = density
    law%n_props = size(props)
    allocate (law%props(size(props) + slack + n_guard), source=0.0_wp)
    law%props(:size(props)) = props
    call set_guard(law%props, size(props), slack)
    law%n_statv = n_statv
    law%n_before = n_statv
    law%n_state = n_statv + n_kept
    law%n_hidden = n_kept
    law%needs_context = .true.
  end subroutine set_user_law

  !> Update without a context. What only a context has (times, deformation gradients, place and
  !! size of the element) is passed as NaN, so that a law that needs it fails at once instead of
  !! working with made-up values; a VUMAT always does, for its frame follows from the gradients.
  subroutine update(self, n, dt, dstrain, stress, state, ok, spin)
    class(user_law_t), intent(in) :: self
    integer, intent(in) :: n
    real(wp), intent(in) :: dt, dstrain(n, 6)
    real(wp), intent(inout) :: stress(n, 6), state(n, self%n_state)
    logical, intent(out) :: ok
    real(wp), intent(in), optional :: spin(n, 3)
    type(point_context_t) :: context
    real(wp) :: unknown, rotation(n, 3)

    unknown = ieee_value(unknown, ieee_quiet_nan)
    rotation = 0.0_wp
    if (present(spin)) rotation = spin
    context = new_point_context(n)
    context%time = unknown
    context%step_time = unknown
    context%f0 = unknown
    context%f1 = unknown
    context%place = unknown
    context%length = unknown
    call self%update_in_context(context, dt, dstrain, stress, state, ok, rotation)
  end subroutine update

  !> Let the law know that its points lie in a sheet, by one more value of each.
  subroutine set_user_sheet(law)
    class(user_law_t), intent(inout) :: law

    law%n_state = law%n_state + 1
    law%n_hidden = law%n_hidden + 1
    law%angle_state = law%n_state
  end subroutine set_user_sheet

  !> Axis 1 of the material where Abaqus has it in shells.
  subroutine lay_in_sheet(self, n, frame, state)
    class(user_law_t), intent(in) :: self
    integer, intent(in) :: n
    real(wp), intent(in) :: frame(n, 9)
    real(wp), intent(inout) :: state(n, self%n_state)
    integer :: l

    state(:, self%angle_state) = [(angle_in_sheet(frame(l, :)), l=1, n)]
  end subroutine lay_in_sheet

  !> Plane stress by the form for shells, or by the strain 33 that leaves a law of solids without
  !! stress 33; either way in the axes of the material.
  subroutine update_plane_in_context(self, context, dt, dstrain, stress, state, through, ok, spin)
    class(user_law_t), intent(in) :: self
    type(point_context_t), intent(inout) :: context   !! its gradients become stretches
    real(wp), intent(in) :: dt, dstrain(context%n, 3)
    real(wp), intent(inout) :: stress(context%n, 3), state(context%n, self%n_state)
    real(wp), intent(inout) :: through(context%n)
    logical, intent(out) :: ok
    real(wp), intent(in) :: spin(context%n)
    real(wp), dimension(context%n, 2) :: start, middle, finish
    real(wp) :: strain(context%n, 3), turn(context%n)

    associate (n => context%n)
      call find_axes(n, state(:, self%angle_state), spin, context%f0, context%f1, start, middle, &
                     finish, turn)
      if (.not. self%is_rotating) turn = 0.0_wp   ! DROT is that of the axes, and there is none
      strain(:, :2) = dstrain(:, :2)
      strain(:, 3) = 0.5_wp*dstrain(:, 3)
      call turn_into_axes(n, middle, strain)
      strain(:, 3) = 2.0_wp*strain(:, 3)
      call turn_into_axes(n, start, stress)
      if (self%is_plane) then
        call self%update_in_axes(context, dt, strain, stress, state, through, ok, turn)
      else
        call search_in_context(self, context, dt, strain, stress, state, through, ok, turn)
      end if
      call turn_out_of_axes(n, finish, stress)
    end associate
  end subroutine update_plane_in_context

  !> Room for output variables and for field variables of the user after the state variables.
  subroutine set_user_fields(law, n_uvarm, n_fields)
    class(user_law_t), intent(inout) :: law
    integer, intent(in) :: n_uvarm, n_fields

    law%n_uvarm = n_uvarm
    law%n_own_fields = n_fields
    law%n_before = law%n_statv + n_uvarm + n_fields
    law%n_state = law%n_state + n_uvarm + n_fields
    law%n_hidden = law%n_hidden + n_fields
  end subroutine set_user_fields

  !> Let the inelastic work that the user's subroutine reports heat its points.
  subroutine set_user_heating(law, heating)
    class(user_law_t), intent(inout) :: law
    !> Fraction of the work that turns into heat, specific heat, temperature at the start.
    real(wp), intent(in) :: heating(3)

    law%n_state = law%n_state + 1
    law%n_hidden = law%n_hidden + 1
    law%heat_state = law%n_state
    law%heat_per_work = heating(1)/(law%density*heating(2))
    law%start_temperature = heating(3)
  end subroutine set_user_heating

  !> What is known of a failed stress update of a user's subroutine since this was asked last; empty
  !! if there was none.
  subroutine take_user_failure(text, is_refusal)
    character(:), allocatable, intent(out) :: text
    logical, intent(out) :: is_refusal               !! it asks for a smaller increment
    integer(c_int) :: values(3)

    call take_failure(values)
    text = ""
    is_refusal = values(3) == 2
    if (values(1) == 0) return
    text = "the user's subroutine "
    if (is_refusal) then
      text = text//refusal_words//" in "
    else
      text = text//"returns a stress or a state variable that is no finite number in "
    end if
    text = text//"element "//to_text(int(values(1)))//", point "//to_text(int(values(2)))
  end subroutine take_user_failure

  !> Zeros after an argument, and the mark after them.
  pure subroutine set_guard(values, n, n_spare)
    real(wp), intent(inout) :: values(*)
    integer, intent(in) :: n         !! values of the argument
    integer, intent(in) :: n_spare   !! zeros after them

    values(n + 1:n + n_spare) = 0.0_wp
    values(n + n_spare + 1:n + n_spare + n_guard) = mark
  end subroutine set_guard

  !> End the run if the mark after an argument is gone: what followed it is, too.
  subroutine check_guard(values, n, n_spare, name)
    real(wp), intent(in) :: values(*)
    integer, intent(in) :: n, n_spare
    character(*), intent(in) :: name   !! of the argument
    real(wp) :: differences(n_guard), four(4)

    differences = abs(values(n + n_spare + 1:n + n_spare + n_guard) - mark)
    four = differences(:4) + differences(5:)
    if (four(1) + four(2) + four(3) + four(4) <= 0.0_wp) return   ! quicker than ALL
    call end_by_overrun(c_text(name), int(len(name), c_int))
  end subroutine check_guard

  !> End the run if something was written to the zeros after the state variables of the points of
  !! a call: it would be lost, and the law would continue without it.
  subroutine check_spare_states(spare, n_points, n_spare, n_statv, name)
    integer, intent(in) :: n_points                    !! of the call
    integer, intent(in) :: n_spare                     !! zeros of each, a multiple of eight
    real(wp), intent(in) :: spare(n_points*n_spare)
    integer, intent(in) :: n_statv                     !! as *DEPVAR gives it
    character(*), intent(in) :: name                   !! of the argument, with its first index
    character(:), allocatable :: given
    integer :: i

    if (are_zero(n_points*n_spare/8, spare)) return
    i = n_statv + (findloc(abs(spare) <= 0.0_wp, .false., 1, back=.true.) - 1)/n_points + 1
    given = "*DEPVAR of its material gives "//counted(n_statv, "state variable")
    if (n_statv == 0) given = "its material has no *DEPVAR"
    call end_user_run("writes "//name//to_text(i)//"), but "//given//"; expected *DEPVAR with "// &
                      "the number of state variables that the subroutine needs, at least "// &
                      to_text(i))
  end subroutine check_spare_states

  !> Are these all zero? In sums of eight at a time, for this is asked in every call.
  pure logical function are_zero(n, values)
    integer, intent(in) :: n
    real(wp), intent(in) :: values(8, n)
    real(wp) :: eight(8)
    integer :: k

    eight = 0.0_wp
    do k = 1, n
      eight = eight + abs(values(:, k))
    end do
    are_zero = sum(eight) <= 0.0_wp
  end function are_zero

  !> Elastic moduli for the stable time increment: the largest stiffnesses bound the speeds of waves
  !! along the axes. Both are 0 where a stiffness is not positive.
  pure subroutine moduli_of(stiffness, bulk, shear)
    real(wp), intent(in) :: stiffness(6)         !! 11 22 33 12 13 23
    real(wp), intent(out) :: bulk, shear

    bulk = 0.0_wp
    shear = 0.0_wp
    if (.not. all(stiffness > 0.0_wp)) return
    shear = maxval(stiffness(4:))
    bulk = max(maxval(stiffness(:3)) - 4.0_wp/3.0_wp*shear, 1.0e-3_wp*shear)
  end subroutine moduli_of

  !> The same from the stiffnesses of a law in plane stress, E/(1 - nu^2) and G.
  pure subroutine plane_moduli_of(stiffness, bulk, shear)
    real(wp), intent(in) :: stiffness(6)         !! as of `moduli_of`: 11, 22 and 12 count
    real(wp), intent(out) :: bulk, shear
    real(wp) :: poisson

    bulk = 0.0_wp
    shear = 0.0_wp
    if (.not. all(stiffness(in_sheet) > 0.0_wp)) return
    poisson = 1.0_wp - 2.0_wp*stiffness(4)/maxval(stiffness(:2))
    if (.not. (poisson > -1.0_wp .and. poisson < 0.5_wp)) return
    shear = stiffness(4)
    bulk = 2.0_wp*shear*(1.0_wp + poisson)/(3.0_wp*(1.0_wp - 2.0_wp*poisson))
  end subroutine plane_moduli_of

  !> What a stiffness of some components alone shows: a law that is not one for solids. Empty where
  !! all have one, or none.
  function uneven_stiffness(is_stiff) result(words)
    logical, intent(in) :: is_stiff(6)           !! 11, 22, 33, 12, 13, 23
    character(:), allocatable :: words
    character(2), parameter :: names(6) = ["11", "22", "33", "12", "13", "23"]

    words = ""
    if (all(is_stiff) .or. .not. any(is_stiff)) return
    words = "positive for the components "//joined(strings(pack(names, is_stiff)), ", ")// &
            " but not for "//joined(strings(pack(names, .not. is_stiff)), ", ")//", as in a "// &
            "law for shells or plane strain; NTENS = 6 here, as for solids: a law for shells "// &
            "needs *BLANK with ELEMENT=SHELL, or *MATERIAL TEST with STRESS STATE=PLANE "// &
            "STRESS, and *USER MATERIAL without STRESS STATE=THREE DIMENSIONAL"
  end function uneven_stiffness

  !> End the run because of what the call in hand did, such as "returns ...".
  subroutine end_user_run(deed)
    character(*), intent(in) :: deed

    call end_by_problem(c_text(deed), int(len(deed), c_int))
  end subroutine end_user_run

  !> State variables of a point at the start from the user's SDVINI, if there is one.
  subroutine call_sdvini(law, element, point, place, state)
    class(user_law_t), intent(in) :: law
    integer, intent(in) :: element
    integer, intent(in) :: point(2)                    !! in its layer, and the layer
    real(wp), intent(in) :: place(3)
    real(wp), intent(inout) :: state(law%n_statv)
    real(c_double) :: statev(law%n_statv + slack + n_guard + n_room)
    integer :: bad

    if (.not. associated(law%sdvini)) return
    statev(:law%n_statv) = state
    call set_guard(statev, law%n_statv, slack)
    call enter_user_call(in_sdvini, int(element, c_int), int(point(1), c_int), int(element, c_int))
    call law%sdvini(statev, place, int(law%n_statv, c_int), 3_c_int, int(element, c_int), &
                    int(point(1), c_int), 1_c_int, int(point(2), c_int))
    call check_guard(statev, law%n_statv, slack, "STATEV")
    call check_spare_states(statev(law%n_statv + 1), 1, slack, law%n_statv, "STATEV(")
    bad = findloc(ieee_is_finite(statev(:law%n_statv)), .false., 1)
    if (bad > 0) call end_user_run("returns no finite number (NaN or infinity) as STATEV("// &
                                   to_text(bad)//")")
    call leave_user_call()
    state = statev(:law%n_statv)
  end subroutine call_sdvini

end module user_call
