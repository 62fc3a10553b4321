!> What every constitutive law offers: the stress update of a row of points in one call.
module block_law
  use kinds, only: wp
  use failure, only: error_t
  use law_spec, only: law_spec_t
  use point_context, only: point_context_t
  use plane_stress, only: plane_trial, begin_search, advance_search, max_trials, is_as_good
  implicit none
  private

  public :: set_elastic, copy_properties, search_plane, search_in_context

  !> A law bound to its constants. A row holds `n` points, one per lane.
  type, abstract, public :: block_law_t
    integer :: n_state = 0        !! state variables per point
    integer :: n_hidden = 0       !! the last of them, which no result shows
    integer :: eqps_state = 0     !! which of them is the equivalent plastic strain, 0: none
    real(wp) :: density = 0.0_wp  !! [mass/length^3]
    real(wp) :: bulk = 0.0_wp     !! elastic bulk modulus [stress]
    real(wp) :: shear = 0.0_wp    !! elastic shear modulus [stress]
    logical :: needs_context = .false.   !! it is called through `update_in_context`
    logical :: needs_gradients = .true.  !! with deformation gradients in the context
    integer :: n_together = 1            !! elements that such a call has at least, if there are
    logical :: is_rotating = .false.     !! it rotates the stress itself (co-rotational frame)
    logical :: uses_gradient = .false.   !! its stress follows from the deformation gradient alone
    logical :: is_serial = .false.       !! one thread, in the order of the elements
    logical :: is_awake = .false.        !! elastic rows take the return map as well
    logical :: has_damage = .false.      !! the last state variable is a damage indicator
    logical :: takes_trial = .false.     !! in plane stress `return_plane` is all it has to do
  contains
    procedure(update_row), deferred :: update
    procedure :: update_plane
    procedure :: return_plane
    procedure :: update_plane_in_context => search_in_context
    procedure :: lay_in_sheet
    procedure :: update_in_context
    procedure :: keeps_plane
    procedure :: shear_warning
    procedure :: wake
  end type block_law_t

  !> How a deck names a law and what builds it: what the file of a law adds to `material_table`.
  type, public :: law_entry_t
    character(16) :: name = ""                !! as in `law_spec_t`
    integer :: n_constants = -1               !! of its own; -1: the constructor checks them
    character(64) :: constants = ""           !! in words, such as "two constants: C10, D1"
    procedure(build_law), pointer, nopass :: build => null()
  end type law_entry_t

  abstract interface
    !> Build a law from its constants. Density and elastic constants are checked already, and so is
    !! the number of its own constants unless `n_constants` is -1.
    subroutine build_law(spec, law, error)
      import :: law_spec_t, block_law_t, error_t
      type(law_spec_t), intent(in) :: spec
      class(block_law_t), allocatable, intent(out) :: law
      type(error_t), allocatable, intent(out) :: error
    end subroutine build_law

    !> Carry stress and state of `n` points over one increment, elastic predictor inside. The
    !! stress comes rotated by the spin; a law with directions of its own rotates them by it too.
    subroutine update_row(self, n, dt, dstrain, stress, state, ok, spin)
      import :: block_law_t, wp
      class(block_law_t), intent(in) :: self
      integer, intent(in) :: n
      real(wp), intent(in) :: dt                               !! [time]
      real(wp), intent(in) :: dstrain(n, 6)                    !! 11 22 33 12 13 23, engineering
      real(wp), intent(inout) :: stress(n, 6)                  !! Cauchy, already rotated
      real(wp), intent(inout) :: state(n, self%n_state)
      logical, intent(out) :: ok                               !! false: some point failed
      real(wp), intent(in), optional :: spin(n, 3)             !! increment 12 13 23, absent: none
    end subroutine update_row
  end interface

contains

  !> Set density and elastic moduli.
  pure subroutine set_elastic(law, density, young, poisson)
    class(block_law_t), intent(inout) :: law
    real(wp), intent(in) :: density, young, poisson

    law%density = density
    law%bulk = young/(3.0_wp*(1.0_wp - 2.0_wp*poisson))
    law%shear = young/(2.0_wp*(1.0_wp + poisson))
  end subroutine set_elastic

  !> Give a law that calls another one the properties of that.
  pure subroutine copy_properties(from, to)
    class(block_law_t), intent(in) :: from
    class(block_law_t), intent(inout) :: to

    to%n_state = from%n_state
    to%n_hidden = from%n_hidden
    to%eqps_state = from%eqps_state
    to%density = from%density
    to%bulk = from%bulk
    to%shear = from%shear
    to%needs_context = from%needs_context
    to%needs_gradients = from%needs_gradients
    to%n_together = from%n_together
    to%is_rotating = from%is_rotating
    to%uses_gradient = from%uses_gradient
    to%is_serial = from%is_serial
    to%is_awake = from%is_awake
    to%has_damage = from%has_damage
  end subroutine copy_properties

  !> Carry stress and state of `n` points in plane stress over one increment, in the frame of the
  !! sheet. A law with a return of its own for plane stress overrides this, or `return_plane`.
  subroutine update_plane(self, n, dt, dstrain, stress, state, through, ok, spin)
    class(block_law_t), intent(in) :: self
    integer, intent(in) :: n
    real(wp), intent(in) :: dt, dstrain(n, 3)     !! see `search_plane`
    real(wp), intent(inout) :: stress(n, 3), state(n, self%n_state), through(n)
    logical, intent(out) :: ok
    real(wp), intent(in) :: spin(n)
    real(wp) :: modes(n, 3), worst

    if (self%takes_trial) then
      call plane_trial(n, self%bulk, self%shear, dstrain, stress, through, modes, worst)
      call self%return_plane(n, dt, stress, state, through, worst, ok)
    else
      call search_plane(self, n, dt, dstrain, stress, state, through, ok, spin)
    end if
  end subroutine update_plane

  !> What follows the elastic trial of `plane_trial`, of laws that need no more than that. Here
  !! nothing does, unless some stress is not a number.
  subroutine return_plane(self, n, dt, stress, state, through, worst, ok)
    class(block_law_t), intent(in) :: self
    integer, intent(in) :: n
    real(wp), intent(in) :: dt                    !! [time]
    real(wp), intent(inout) :: stress(n, 3)       !! 11 22 12, of the trial
    real(wp), intent(inout) :: state(n, self%n_state)
    real(wp), intent(inout) :: through(n)         !! strain increment 33, of the trial
    real(wp), intent(in) :: worst                 !! see `plane_trial`
    logical, intent(out) :: ok                    !! false: some point failed

    ok = worst < huge(worst) .and. dt >= 0.0_wp
  end subroutine return_plane

  !> `update` with the strain 33 that leaves no stress 33. Shears 13 and 23 are zero. A law that
  !! needs a context fails.
  subroutine search_plane(self, n, dt, dstrain, stress, state, through, ok, spin)
    class(block_law_t), intent(in) :: self
    integer, intent(in) :: n
    real(wp), intent(in) :: dt                    !! [time]
    real(wp), intent(in) :: dstrain(n, 3)         !! 11 22 12, engineering shear
    real(wp), intent(inout) :: stress(n, 3)       !! Cauchy 11 22 12, rotated to the end frame
    real(wp), intent(inout) :: state(n, self%n_state)
    real(wp), intent(inout) :: through(n)         !! strain increment 33, the one before and this
    logical, intent(out) :: ok                    !! false: some point failed
    real(wp), intent(in) :: spin(n)               !! of the material against the frame, 12

    ok = .not. self%needs_context
    if (ok) call search(self, n, dt, dstrain, stress, state, through, ok, spin)
  end subroutine search_plane

  !> The same of a law that needs the context of its points, whose deformation gradients count in
  !! the frame; what they have of the strain 33 of the increment is found here.
  subroutine search_in_context(self, context, dt, dstrain, stress, state, through, ok, spin)
    class(block_law_t), intent(in) :: self
    type(point_context_t), intent(inout) :: context
    real(wp), intent(in) :: dt, dstrain(context%n, 3)
    real(wp), intent(inout) :: stress(context%n, 3), state(context%n, self%n_state)
    real(wp), intent(inout) :: through(context%n)
    logical, intent(out) :: ok
    real(wp), intent(in) :: spin(context%n)

    call search(self, context%n, dt, dstrain, stress, state, through, ok, spin, context)
  end subroutine search_in_context

  subroutine search(self, n, dt, dstrain, stress, state, through, ok, spin, context)
    class(block_law_t), intent(in) :: self
    integer, intent(in) :: n
    real(wp), intent(in) :: dt, dstrain(n, 3)
    real(wp), intent(inout) :: stress(n, 3), state(n, self%n_state), through(n)
    logical, intent(out) :: ok
    real(wp), intent(in) :: spin(n)
    type(point_context_t), intent(inout), optional :: context
    real(wp), dimension(n, 6) :: strain, before, tried
    real(wp) :: new_state(n, self%n_state), turn(n, 3), search_values(n, 4)
    real(wp), parameter :: rounding = 1.0e-14_wp   ! of what follows from gradients
    real(wp) :: noise
    logical :: is_found
    integer :: iteration

    noise = 0.0_wp
    if (present(context)) noise = rounding*self%bulk
    strain = 0.0_wp
    strain(:, :2) = dstrain(:, :2)
    strain(:, 3) = through
    strain(:, 4) = dstrain(:, 3)
    before = 0.0_wp
    before(:, :2) = stress(:, :2)
    before(:, 4) = stress(:, 3)
    turn = 0.0_wp
    turn(:, 1) = spin
    call begin_search(n, self%bulk, self%shear, strain, search_values)
    do iteration = 1, max_trials
      tried = before
      new_state = state
      if (present(context)) then
        context%f1(:, 9) = context%f0(:, 9)*exp(strain(:, 3))
        call self%update_in_context(context, dt, strain, tried, new_state, ok, turn)
      else
        call self%update(n, dt, strain, tried, new_state, ok, turn)
      end if
      if (.not. ok) return
      through = strain(:, 3)
      call advance_search(n, iteration, self%bulk, self%shear, noise, before, tried, strain, &
                          search_values, is_found)
      if (is_found) exit
    end do
    ! A user's law may itself iterate to no better than that.
    if (.not. is_found .and. present(context)) &
      is_found = is_as_good(n, self%shear, tried, strain, search_values)
    ok = is_found
    stress(:, :2) = tried(:, :2)
    stress(:, 3) = tried(:, 4)
    state = new_state
  end subroutine search

  !> Let the state of points of a sheet count in their frames, before the first `update_plane`. Laws
  !! without directions of their own have nothing to do.
  subroutine lay_in_sheet(self, n, frame, state)
    class(block_law_t), intent(in) :: self
    integer, intent(in) :: n
    real(wp), intent(in) :: frame(n, 9)        !! component j of frame axis i at 3 (i - 1) + j
    real(wp), intent(inout) :: state(n, self%n_state)
  end subroutine lay_in_sheet

  !> Does a state that is its own picture on the other side of the plane across a coordinate stay so
  !! in a motion that does? True where no direction of the material says otherwise.
  pure logical function keeps_plane(self, component)
    class(block_law_t), intent(in) :: self
    integer, intent(in) :: component     !! 1 x, 2 y, 3 z

    keeps_plane = component >= 1 .and. component <= 3 .and. .not. self%needs_context
  end function keeps_plane

  !> Why the stress of the law is wrong in large shear; empty where it is not.
  pure function shear_warning(self) result(warning)
    class(block_law_t), intent(in) :: self
    character(:), allocatable :: warning

    warning = ""
  end function shear_warning

  !> Let elastic rows take the return map as well.
  subroutine wake(self)
    class(block_law_t), intent(inout) :: self

    self%is_awake = .true.
  end subroutine wake

  !> Update of a law that asks for kinematics and places, of several integration points of many
  !! elements: all elements of the first point, then of the next. Others need none of it.
  subroutine update_in_context(self, context, dt, dstrain, stress, state, ok, spin)
    class(block_law_t), intent(in) :: self
    type(point_context_t), intent(in) :: context
    real(wp), intent(in) :: dt, dstrain(context%n, 6)
    real(wp), intent(inout) :: stress(context%n, 6), state(context%n, self%n_state)
    logical, intent(out) :: ok
    real(wp), intent(in) :: spin(context%n, 3)

    call self%update(context%n, dt, dstrain, stress, state, ok, spin)
  end subroutine update_in_context

end module block_law
