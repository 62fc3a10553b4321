!> A neo-Hookean law for tests: it takes the stress from the deformation gradient alone.
module gradient_law
  use kinds, only: wp
  use block_law, only: block_law_t
  use point_context, only: point_context_t
  implicit none
  private

  public :: new_gradient_law, neo_hookean_stress

  type, extends(block_law_t), public :: gradient_law_t
  contains
    procedure :: update
    procedure :: update_in_context
  end type gradient_law_t

contains

  function new_gradient_law() result(law)
    type(gradient_law_t) :: law

    law%shear = 2.0_wp
    law%bulk = 20.0_wp
    law%needs_context = .true.
    law%is_rotating = .true.
  end function new_gradient_law

  !> Without the gradient there is no stress.
  subroutine update(self, n, dt, dstrain, stress, state, ok, spin)
    class(gradient_law_t), intent(in) :: self
    integer, intent(in) :: n
    real(wp), intent(in) :: dt, dstrain(n, 6)
    real(wp), intent(inout) :: stress(n, 6), state(n, self%n_state)
    logical, intent(out) :: ok
    real(wp), intent(in), optional :: spin(n, 3)

    ok = dt < 0.0_wp .and. present(spin) .and. size(state) < 0
    if (ok) stress = stress + dstrain
  end subroutine update

  subroutine update_in_context(self, context, dt, dstrain, stress, state, ok, spin)
    class(gradient_law_t), intent(in) :: self
    type(point_context_t), intent(in) :: context
    real(wp), intent(in) :: dt, dstrain(context%n, 6)
    real(wp), intent(inout) :: stress(context%n, 6), state(context%n, self%n_state)
    logical, intent(out) :: ok
    real(wp), intent(in) :: spin(context%n, 3)
    integer :: l

    ok = dt >= 0.0_wp .and. size(dstrain) == 2*size(spin) .and. size(state) == 0
    do l = 1, context%n
      stress(l, :) = neo_hookean_stress(self, transpose(reshape(context%f1(l, :), [3, 3])))
    end do
  end subroutine update_in_context

  !> G/J (F F' - I) + (K - 2/3 G) ln(J)/J I.
  pure function neo_hookean_stress(law, f) result(stress)
    class(block_law_t), intent(in) :: law
    real(wp), intent(in) :: f(3, 3)
    real(wp) :: stress(6), b(3, 3), j

    b = matmul(f, transpose(f))
    j = f(1, 1)*(f(2, 2)*f(3, 3) - f(2, 3)*f(3, 2)) - f(1, 2)*(f(2, 1)*f(3, 3) - f(2, 3)*f(3, 1)) &
        + f(1, 3)*(f(2, 1)*f(3, 2) - f(2, 2)*f(3, 1))
    stress = law%shear/j*[b(1, 1) - 1.0_wp, b(2, 2) - 1.0_wp, b(3, 3) - 1.0_wp, b(1, 2), b(1, 3), &
                          b(2, 3)]
    stress(:3) = stress(:3) + (law%bulk - 2.0_wp/3.0_wp*law%shear)*log(j)/j
  end function neo_hookean_stress

end module gradient_law
