!> Neo-Hookean elasticity: energy C10 (I1 - 3) + (J - 1)^2/D1 per volume at the start.
!!
!! I1 is the first invariant of the left Cauchy-Green tensor without its change of volume, C10 is
!! half the shear modulus and D1 two over the bulk modulus (R. S. Rivlin, Phil. Trans. R. Soc. A 240
!! (1948); the part of the volume as in J. Bonet and R. D. Wood, Nonlinear Continuum Mechanics,
!! Cambridge 2008, section 6.5).
module neo_hooke
  use kinds, only: wp
  use failure, only: error_t
  use law_spec, only: law_spec_t
  use block_law, only: block_law_t, law_entry_t, set_elastic
  use point_context, only: point_context_t
  implicit none
  private

  public :: new_neo_hooke, neo_hooke_law

  !> The moduli are those of the base type; the stress follows from the deformation gradient, so
  !! there is no state.
  type, extends(block_law_t), public :: neo_hooke_t
  contains
    procedure :: update
    procedure :: update_in_context
  end type neo_hooke_t

contains

  !> *HYPERELASTIC, NEO HOOKE.
  function neo_hooke_law() result(entry)
    type(law_entry_t) :: entry

    entry = law_entry_t("NEO HOOKE", 0, "no constants of its own", build)
  end function neo_hooke_law

  subroutine build(spec, law, error)
    type(law_spec_t), intent(in) :: spec
    class(block_law_t), allocatable, intent(out) :: law
    type(error_t), allocatable, intent(out) :: error

    allocate (law, source=new_neo_hooke(spec%density, spec%young, spec%poisson))
  end subroutine build

  !> Law from density and the elastic constants of small strains.
  pure function new_neo_hooke(density, young, poisson) result(law)
    real(wp), intent(in) :: density, young, poisson
    type(neo_hooke_t) :: law

    law%needs_context = .true.
    call set_elastic(law, density, young, poisson)
    law%uses_gradient = .true.
  end function new_neo_hooke

  !> Without the deformation gradient there is no stress: this always fails.
  subroutine update(self, n, dt, dstrain, stress, state, ok, spin)
    class(neo_hooke_t), intent(in) :: self
    integer, intent(in) :: n
    real(wp), intent(in) :: dt, dstrain(n, 6)
    real(wp), intent(inout) :: stress(n, 6), state(n, self%n_state)
    logical, intent(out) :: ok
    real(wp), intent(in), optional :: spin(n, 3)

    ok = .false.
  end subroutine update

  !> Stress from the deformation gradient at the end of the increment. Fails where its
  !! determinant is not positive or not a number.
  subroutine update_in_context(self, context, dt, dstrain, stress, state, ok, spin)
    class(neo_hooke_t), intent(in) :: self
    type(point_context_t), intent(in) :: context
    real(wp), intent(in) :: dt, dstrain(context%n, 6)
    real(wp), intent(inout) :: stress(context%n, 6), state(context%n, self%n_state)
    logical, intent(out) :: ok
    real(wp), intent(in) :: spin(context%n, 3)
    real(wp) :: b(6), volume, mean, scaling
    integer :: l

    ok = .true.
    do l = 1, context%n
      associate (f => context%f1(l, :))
        volume = f(1)*(f(5)*f(9) - f(6)*f(8)) + f(2)*(f(6)*f(7) - f(4)*f(9)) &
                 + f(3)*(f(4)*f(8) - f(5)*f(7))
        ok = ok .and. volume > 0.0_wp .and. volume <= huge(volume)
        if (.not. ok) return
        b = [sum(f(:3)**2), sum(f(4:6)**2), sum(f(7:)**2), sum(f(:3)*f(4:6)), sum(f(:3)*f(7:)), &
             sum(f(4:6)*f(7:))]
      end associate
      scaling = self%shear*volume**(-5.0_wp/3.0_wp)
      mean = sum(b(:3))/3.0_wp
      stress(l, :3) = scaling*(b(:3) - mean) + self%bulk*(volume - 1.0_wp)
      stress(l, 4:) = scaling*b(4:)
    end do
  end subroutine update_in_context

end module neo_hooke
