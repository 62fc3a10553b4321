!> Isotropic linear elasticity in rate form (hypoelastic).
module elastic
  use kinds, only: wp
  use failure, only: error_t
  use law_spec, only: law_spec_t
  use block_law, only: block_law_t, law_entry_t, set_elastic
  implicit none
  private

  public :: new_elastic, elastic_law

  !> Elastic law; the moduli are those of the base type, and so is the return in plane stress.
  type, extends(block_law_t), public :: elastic_t
  contains
    procedure :: update
    procedure :: shear_warning
  end type elastic_t

contains

  !> *ELASTIC without *PLASTIC.
  function elastic_law() result(entry)
    type(law_entry_t) :: entry

    entry = law_entry_t("ELASTIC", 0, "no constants of its own", build)
  end function elastic_law

  subroutine build(spec, law, error)
    type(law_spec_t), intent(in) :: spec
    class(block_law_t), allocatable, intent(out) :: law
    type(error_t), allocatable, intent(out) :: error

    allocate (law, source=new_elastic(spec%density, spec%young, spec%poisson))
  end subroutine build

  !> Law from density, Young's modulus and Poisson's ratio.
  pure function new_elastic(density, young, poisson) result(law)
    real(wp), intent(in) :: density, young, poisson
    type(elastic_t) :: law

    call set_elastic(law, density, young, poisson)
    law%takes_trial = .true.
  end function new_elastic

  !> Add the elastic increment; never fails.
  subroutine update(self, n, dt, dstrain, stress, state, ok, spin)
    class(elastic_t), intent(in) :: self
    integer, intent(in) :: n
    real(wp), intent(in) :: dt, dstrain(n, 6)
    real(wp), intent(inout) :: stress(n, 6), state(n, self%n_state)
    logical, intent(out) :: ok
    real(wp), intent(in), optional :: spin(n, 3)
    real(wp) :: lame, volume
    integer :: l

    ok = dt >= 0.0_wp .and. size(state, 2) == 0
    lame = self%bulk - 2.0_wp/3.0_wp*self%shear
    !$omp simd private(volume)
    do l = 1, n
      volume = lame*(dstrain(l, 1) + dstrain(l, 2) + dstrain(l, 3))
      stress(l, 1) = stress(l, 1) + volume + 2.0_wp*self%shear*dstrain(l, 1)
      stress(l, 2) = stress(l, 2) + volume + 2.0_wp*self%shear*dstrain(l, 2)
      stress(l, 3) = stress(l, 3) + volume + 2.0_wp*self%shear*dstrain(l, 3)
      stress(l, 4) = stress(l, 4) + self%shear*dstrain(l, 4)
      stress(l, 5) = stress(l, 5) + self%shear*dstrain(l, 5)
      stress(l, 6) = stress(l, 6) + self%shear*dstrain(l, 6)
    end do
  end subroutine update

  !> Hooke's law in rates: the shear stress is G sin(gamma).
  pure function shear_warning(self) result(warning)
    class(elastic_t), intent(in) :: self
    character(:), allocatable :: warning

    warning = "the stress of *ELASTIC rotates with the spin (Jaumann rate) and falls in large "// &
              "shear; *HYPERELASTIC does not"
  end function shear_warning

end module elastic
