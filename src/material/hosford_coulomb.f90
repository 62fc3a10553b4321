!> Ductile fracture by the Hosford-Coulomb criterion: the equivalent plastic strain at fracture
!! under a stress that keeps its direction.
!!
!! D. Mohr and S. J. Marcadet, Int. J. Solids Struct. 67-68 (2015): with the principal stresses
!! s1 >= s2 >= s3 and the von Mises stress q, fracture comes at
!! b ((1 + c)/h)^(1/n), h = (((s1 - s2)^a + (s2 - s3)^a + (s1 - s3)^a)/2)^(1/a)/q + c (s1 + s3)/q.
!! h follows from the stress triaxiality and the Lode angle parameter, for the stress counts by its
!! direction alone. In uniaxial and equibiaxial tension h is 1 + c, and b the fracture strain.
module hosford_coulomb
  use kinds, only: wp
  use failure, only: error_t
  use constant_check, only: check_finite, check_count, require
  use row_functions, only: power_row
  implicit none
  private

  public :: new_hosford_coulomb, find_damage_per_strain

  !> Constants of the criterion.
  type, public :: hosford_coulomb_t
    real(wp) :: hosford = 1.0_wp      !! a: 2 is von Mises, 1 and infinity are Tresca
    real(wp) :: strain = 1.0_wp       !! b: fracture strain in uniaxial tension
    real(wp) :: friction = 0.0_wp     !! c
    real(wp) :: exponent = 0.1_wp     !! n
  end type hosford_coulomb_t

contains

  !> From a, b, c and n with their bounds checked.
  pure subroutine new_hosford_coulomb(constants, criterion, error)
    real(wp), intent(in) :: constants(:)
    type(hosford_coulomb_t), intent(out) :: criterion
    type(error_t), allocatable, intent(out) :: error

    call check_count("the damage initiation", constants, 4, "four constants: a, b, c, n", error)
    call check_finite("constants of the damage initiation", constants, error)
    if (allocated(error)) return
    call require(constants(1) > 0.0_wp, "material: the exponent a must be positive", error)
    call require(constants(2) > 0.0_wp, "material: the fracture strain b must be positive", error)
    call require(constants(3) >= 0.0_wp, "material: the friction c must not be negative", error)
    call require(constants(4) > 0.0_wp, "material: the exponent n must be positive", error)
    criterion = hosford_coulomb_t(constants(1), constants(2), constants(3), constants(4))
  end subroutine new_hosford_coulomb

  !> Damage of a row by a unit of equivalent plastic strain, 1 over the fracture strain; 0 without
  !! stress and where compression closes voids (h <= 0).
  pure subroutine find_damage_per_strain(criterion, n, high, middle, low, damage)
    type(hosford_coulomb_t), intent(in) :: criterion
    integer, intent(in) :: n
    real(wp), intent(in), dimension(n) :: high, middle, low   !! principal stresses
    real(wp), intent(out) :: damage(n)
    real(wp), parameter :: least = 1.0e-90_wp
    real(wp), dimension(n) :: first, second, span
    real(wp) :: mises
    integer :: l

    ! Over the largest difference, so that no power is too large.
    !$omp simd
    do l = 1, n
      span(l) = max(high(l) - low(l), least)
      first(l) = max((high(l) - middle(l))/span(l), least)
      second(l) = max((middle(l) - low(l))/span(l), least)
      damage(l) = first(l)*first(l) + second(l)*second(l)
    end do
    call power_row(n, criterion%hosford, first)
    call power_row(n, criterion%hosford, second)
    first = 0.5_wp*(1.0_wp + first + second)
    call power_row(n, 1.0_wp/criterion%hosford, first)
    !$omp simd private(mises)
    do l = 1, n
      mises = span(l)*sqrt(0.5_wp*(1.0_wp + damage(l)))
      damage(l) = max((span(l)*first(l) + criterion%friction*(high(l) + low(l))) &
                      /(mises*(1.0_wp + criterion%friction)), least)
      second(l) = damage(l)
    end do
    call power_row(n, 1.0_wp/criterion%exponent, damage)
    !$omp simd
    do l = 1, n
      damage(l) = merge(damage(l)/criterion%strain, 0.0_wp, &
                        second(l) > least .and. span(l) > least)
    end do
  end subroutine find_damage_per_strain

end module hosford_coulomb
