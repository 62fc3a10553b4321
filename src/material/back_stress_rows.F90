!> What von Mises plasticity with back stresses works out for a row of points: the products of
!! tensors, the relative stress and the flow along it.
!!
!! What loops over back stresses within a loop over points is there for one, two, three and four of
!! them, so that the inner loop opens up, and for any other number, which is slower.
module back_stress_rows
  use kinds, only: wp
  use hardening, only: back_stresses_t
  implicit none
  private

  public :: multiply, find_products, relative_stress, flow_relative

contains

  !> Products of the deviator (0) and the back stresses i <= k. That of the deviator with itself is
  !! left to the caller.
  pure subroutine find_products(n, n_back, stress, back, products)
    integer, intent(in) :: n, n_back
    real(wp), intent(in) :: stress(n, 6), back(n, 6, n_back)
    real(wp), intent(inout) :: products(n, 0:n_back, 0:n_back)
    integer :: i, k

    do k = 1, n_back
      call multiply(n, stress, back(:, :, k), products(:, 0, k))
      do i = 1, k
        call multiply(n, back(:, :, i), back(:, :, k), products(:, i, k))
      end do
    end do
  end subroutine find_products

  !> 3/2 a:b of the deviator of a with the deviator b, the square of the von Mises norm for a
  !! deviator with itself.
  pure subroutine multiply(n, a, b, product)
    integer, intent(in) :: n
    real(wp), intent(in) :: a(n, 6), b(n, 6)
    real(wp), intent(out) :: product(n)
    integer :: l

    !$omp simd
    do l = 1, n
      product(l) = 1.5_wp*((a(l, 1) - a(l, 3))*b(l, 1) + (a(l, 2) - a(l, 3))*b(l, 2)) &
                   + 3.0_wp*(a(l, 4)*b(l, 4) + a(l, 5)*b(l, 5) + a(l, 6)*b(l, 6))
    end do
  end subroutine multiply

  !> |s - sum theta alpha| - (3G + sum theta C) dgamma with theta = 1/(1 + gamma dgamma), by how
  !! much it falls with `dgamma` and how this fall fades.
  pure subroutine relative_stress(n, shear3, kinematic, products, dgamma, norm, fall, curvature)
    integer, intent(in) :: n
    real(wp), intent(in) :: shear3                 !! 3G
    type(back_stresses_t), intent(in) :: kinematic
    real(wp), intent(in) :: products(n, 0:kinematic%n, 0:kinematic%n), dgamma(n)
    real(wp), intent(out), dimension(n) :: norm, fall, curvature

    select case (kinematic%n)
    case (1)
      call relative_one(n, shear3, kinematic%recall, kinematic%modulus, products, dgamma, norm, &
                        fall, curvature)
    case (2)
      call relative_two(n, shear3, kinematic%recall, kinematic%modulus, products, dgamma, norm, &
                        fall, curvature)
    case (3)
      call relative_three(n, shear3, kinematic%recall, kinematic%modulus, products, dgamma, norm, &
                        fall, curvature)
    case (4)
      call relative_four(n, shear3, kinematic%recall, kinematic%modulus, products, dgamma, norm, &
                        fall, curvature)
    case default
      call relative_any(kinematic%n, n, shear3, kinematic%recall, kinematic%modulus, products, &
                        dgamma, norm, fall, curvature)
    end select
  end subroutine relative_stress

  !> Flow by `dgamma` along the relative stress, whose von Mises norm comes back.
  pure subroutine flow_relative(n, shear3, kinematic, dgamma, stress, back, norm)
    integer, intent(in) :: n
    real(wp), intent(in) :: shear3                 !! 3G
    type(back_stresses_t), intent(in) :: kinematic
    real(wp), intent(in) :: dgamma(n)
    real(wp), intent(inout) :: stress(n, 6), back(n, 6, kinematic%n)
    real(wp), intent(out) :: norm(n)

    select case (kinematic%n)
    case (1)
      call flow_one(n, shear3, kinematic%recall, kinematic%modulus, dgamma, stress, back, norm)
    case (2)
      call flow_two(n, shear3, kinematic%recall, kinematic%modulus, dgamma, stress, back, norm)
    case (3)
      call flow_three(n, shear3, kinematic%recall, kinematic%modulus, dgamma, stress, back, norm)
    case (4)
      call flow_four(n, shear3, kinematic%recall, kinematic%modulus, dgamma, stress, back, norm)
    case default
      call flow_any(kinematic%n, n, shear3, kinematic%recall, kinematic%modulus, dgamma, stress, &
                    back, norm)
    end select
  end subroutine flow_relative

  pure subroutine relative_one(n, shear3, recall, modulus, products, dgamma, norm, fall, &
                               curvature)
    integer, parameter :: n_back = 1
#include "relative_stress.inc"
  end subroutine relative_one

  pure subroutine relative_two(n, shear3, recall, modulus, products, dgamma, norm, fall, &
                               curvature)
    integer, parameter :: n_back = 2
#include "relative_stress.inc"
  end subroutine relative_two

  pure subroutine relative_three(n, shear3, recall, modulus, products, dgamma, norm, fall, &
                                 curvature)
    integer, parameter :: n_back = 3
#include "relative_stress.inc"
  end subroutine relative_three

  pure subroutine relative_four(n, shear3, recall, modulus, products, dgamma, norm, fall, &
                                curvature)
    integer, parameter :: n_back = 4
#include "relative_stress.inc"
  end subroutine relative_four

  pure subroutine relative_any(n_back, n, shear3, recall, modulus, products, dgamma, norm, fall, &
                               curvature)
    integer, intent(in) :: n_back
#include "relative_stress.inc"
  end subroutine relative_any

  pure subroutine flow_one(n, shear3, recall, modulus, dgamma, stress, back, norm)
    integer, parameter :: n_back = 1
#include "relative_flow.inc"
  end subroutine flow_one

  pure subroutine flow_two(n, shear3, recall, modulus, dgamma, stress, back, norm)
    integer, parameter :: n_back = 2
#include "relative_flow.inc"
  end subroutine flow_two

  pure subroutine flow_three(n, shear3, recall, modulus, dgamma, stress, back, norm)
    integer, parameter :: n_back = 3
#include "relative_flow.inc"
  end subroutine flow_three

  pure subroutine flow_four(n, shear3, recall, modulus, dgamma, stress, back, norm)
    integer, parameter :: n_back = 4
#include "relative_flow.inc"
  end subroutine flow_four

  pure subroutine flow_any(n_back, n, shear3, recall, modulus, dgamma, stress, back, norm)
    integer, intent(in) :: n_back
#include "relative_flow.inc"
  end subroutine flow_any

end module back_stress_rows
