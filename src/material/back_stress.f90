!> Back stresses of kinematic hardening, several at a point.
!!
!! P. J. Armstrong and C. O. Frederick, CEGB report RD/B/N 731 (1966), several of them as J. L.
!! Chaboche, Int. J. Plasticity 2 (1986): each grows by 2/3 C deps_p - gamma alpha deqps with the
!! plastic strain deps_p, so that for von Mises C and gamma are those of a tension curve. For any
!! convex yield function gamma/C times the square of the back stress is lost then, never won.
module back_stress
  use kinds, only: wp
  use failure, only: error_t
  use constant_check, only: check_finite, require
  implicit none
  private

  public :: new_back_stresses

  !> Constants of the back stresses of a law.
  type, public :: back_stresses_t
    integer :: n = 0
    real(wp), allocatable :: modulus(:)   !! C, slope at the start [stress], shape (n)
    real(wp), allocatable :: recall(:)    !! gamma, C/gamma is where it ends, shape (n)
  end type back_stresses_t

contains

  !> From pairs of C > 0 and gamma >= 0.
  pure subroutine new_back_stresses(pairs, back, error)
    real(wp), intent(in) :: pairs(:)
    type(back_stresses_t), intent(out) :: back
    type(error_t), allocatable, intent(out) :: error

    call require(size(pairs) > 0 .and. mod(size(pairs), 2) == 0, &
                 "material: back stresses take pairs of C and gamma", error)
    call check_finite("constants of back stresses", pairs, error)
    call require(all(pairs(1::2) > 0.0_wp), &
                 "material: the modulus C of a back stress must be positive", error)
    call require(all(pairs(2::2) >= 0.0_wp), &
                 "material: the recall gamma of a back stress must not be negative", error)
    back%n = size(pairs)/2
    back%modulus = pairs(1::2)
    back%recall = pairs(2::2)
  end subroutine new_back_stresses

end module back_stress
