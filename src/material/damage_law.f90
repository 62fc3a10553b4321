!> A law with a damage indicator: the integral of the equivalent plastic strain over the fracture
!! strain of the stress at hand. The indicator follows from the stress and the plastic strain that
!! any law returns and does not act back on them.
module damage_law
  use kinds, only: wp
  use failure, only: error_t
  use block_law, only: block_law_t, copy_properties
  use hosford_coulomb, only: hosford_coulomb_t, new_hosford_coulomb, find_damage_per_strain
  use principal_stresses, only: find_principal, find_principal_of_sheet
  implicit none
  private

  public :: add_damage

  !> The state is that of the law and, as the last variable, the indicator.
  type, extends(block_law_t), public :: damage_law_t
    class(block_law_t), allocatable :: law      !! that needs no context and has `eqps_state`
    type(hosford_coulomb_t) :: criterion
  contains
    procedure :: update
    procedure :: update_plane
    procedure :: lay_in_sheet
    procedure :: keeps_plane
    procedure :: shear_warning
    procedure :: wake
  end type damage_law_t

contains

  !> Replace a law by itself with an indicator, from the constants of the criterion.
  subroutine add_damage(constants, law, error)
    real(wp), intent(in) :: constants(:)
    class(block_law_t), allocatable, intent(inout) :: law
    type(error_t), allocatable, intent(out) :: error
    type(damage_law_t), allocatable :: new

    allocate (new)
    call new_hosford_coulomb(constants, new%criterion, error)
    if (allocated(error)) return
    call copy_properties(law, new)
    new%n_state = law%n_state + 1
    new%has_damage = .true.
    call move_alloc(law, new%law)
    call move_alloc(new, law)
  end subroutine add_damage

  subroutine update(self, n, dt, dstrain, stress, state, ok, spin)
    class(damage_law_t), intent(in) :: self
    integer, intent(in) :: n
    real(wp), intent(in) :: dt, dstrain(n, 6)
    real(wp), intent(inout) :: stress(n, 6), state(n, self%n_state)
    logical, intent(out) :: ok
    real(wp), intent(in), optional :: spin(n, 3)
    real(wp), dimension(n) :: growth, high, middle, low

    growth = state(:, self%eqps_state)
    call self%law%update(n, dt, dstrain, stress, state(:, :self%law%n_state), ok, spin)
    growth = state(:, self%eqps_state) - growth
    if (.not. (ok .and. any(growth > 0.0_wp))) return
    call find_principal(n, stress, high, middle, low)
    call add_growth(self%criterion, n, high, middle, low, growth, state(:, self%n_state))
  end subroutine update

  subroutine update_plane(self, n, dt, dstrain, stress, state, through, ok, spin)
    class(damage_law_t), intent(in) :: self
    integer, intent(in) :: n
    real(wp), intent(in) :: dt, dstrain(n, 3)
    real(wp), intent(inout) :: stress(n, 3), state(n, self%n_state), through(n)
    logical, intent(out) :: ok
    real(wp), intent(in) :: spin(n)
    real(wp), dimension(n) :: growth, high, middle, low

    growth = state(:, self%eqps_state)
    call self%law%update_plane(n, dt, dstrain, stress, state(:, :self%law%n_state), through, ok, &
                               spin)
    growth = state(:, self%eqps_state) - growth
    if (.not. (ok .and. any(growth > 0.0_wp))) return
    call find_principal_of_sheet(n, stress, high, middle, low)
    call add_growth(self%criterion, n, high, middle, low, growth, state(:, self%n_state))
  end subroutine update_plane

  !> Add the damage of an increment of plastic strain under the stress at its end.
  pure subroutine add_growth(criterion, n, high, middle, low, growth, damage)
    type(hosford_coulomb_t), intent(in) :: criterion
    integer, intent(in) :: n
    real(wp), intent(in), dimension(n) :: high, middle, low   !! principal stresses
    real(wp), intent(in) :: growth(n)                         !! of the plastic strain
    real(wp), intent(inout) :: damage(n)
    real(wp) :: per_strain(n)

    call find_damage_per_strain(criterion, n, high, middle, low, per_strain)
    damage = damage + per_strain*growth
  end subroutine add_growth

  subroutine lay_in_sheet(self, n, frame, state)
    class(damage_law_t), intent(in) :: self
    integer, intent(in) :: n
    real(wp), intent(in) :: frame(n, 9)
    real(wp), intent(inout) :: state(n, self%n_state)

    call self%law%lay_in_sheet(n, frame, state(:, :self%law%n_state))
  end subroutine lay_in_sheet

  pure logical function keeps_plane(self, component)
    class(damage_law_t), intent(in) :: self
    integer, intent(in) :: component

    keeps_plane = self%law%keeps_plane(component)
  end function keeps_plane

  pure function shear_warning(self) result(warning)
    class(damage_law_t), intent(in) :: self
    character(:), allocatable :: warning

    warning = self%law%shear_warning()
  end function shear_warning

  !> The law inside returns the stress.
  subroutine wake(self)
    class(damage_law_t), intent(inout) :: self

    call self%law%wake()
  end subroutine wake

end module damage_law
