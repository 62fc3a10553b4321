!> Yield functions by the principal values of transformed stresses: the sum over i, j of
!! |a_i - b_j|^m is 4 times the equivalent stress to the power m, with one transform or two and any
!! exponent.
module principal_yield
  use kinds, only: wp
  use symmetric_eigen, only: principal_values
  implicit none
  private

  public :: evaluate_by_principal_values

  !> A yield function of this kind.
  type, public :: principal_yield_t
    integer :: n_transforms = 0               !! 1: both are the same
    real(wp) :: transforms(6, 5, 2) = 0.0_wp  !! deviators (`deviator_lanes`) to tensors
    real(wp) :: exponent = 2.0_wp             !! m
    integer :: whole_exponent = 0             !! m as integer, 0 if it is none
  end type principal_yield_t

  !> Principal values of one transform and the matrix that takes an increment of the deviator to the
  !! components 11, 22, 33, 12, 13, 23 in their axes.
  type :: frame_t
    real(wp) :: values(3), matrix(6, 5)
  end type frame_t

contains

  !> Equivalent stress of one deviator, its gradient and its second derivatives.
  pure subroutine evaluate_by_principal_values(yield, stress, q, gradient, hessian)
    type(principal_yield_t), intent(in) :: yield
    real(wp), intent(in) :: stress(5)
    real(wp), intent(out) :: q
    real(wp), intent(out), optional :: gradient(5), hessian(5, 5)
    type(frame_t) :: frames(2)
    real(wp) :: slopes(3, 2), difference(3, 3), largest
    integer :: i, j, k

    do k = 1, yield%n_transforms
      call new_frame(yield%transforms(:, :, k), stress, present(gradient), frames(k))
    end do
    if (yield%n_transforms == 1) frames(2) = frames(1)
    do j = 1, 3
      difference(:, j) = frames(1)%values - frames(2)%values(j)
    end do
    largest = max(maxval(abs(difference)), tiny(largest))
    q = largest*(0.25_wp*sum(power(yield, 0, abs(difference)/largest))) &
        **(1.0_wp/yield%exponent)
    q = max(q, tiny(q))
    if (.not. present(gradient)) return
    difference = difference/q
    slopes(:, 1) = 0.25_wp*sum(power(yield, 2, abs(difference))*difference, 2)
    slopes(:, 2) = -0.25_wp*sum(power(yield, 2, abs(difference))*difference, 1)
    gradient = 0.0_wp
    do k = 1, 2
      do i = 1, 3
        gradient = gradient + slopes(i, k)*frames(k)%matrix(i, :)
      end do
    end do
    if (present(hessian)) call second_derivatives(yield, q, frames, slopes, &
                                                  power(yield, 2, abs(difference)), hessian)
  end subroutine evaluate_by_principal_values

  !> Principal values of a transform of the stress, and its matrix if it is asked for.
  pure subroutine new_frame(transform, stress, with_matrix, frame)
    real(wp), intent(in) :: transform(6, 5), stress(5)
    logical, intent(in) :: with_matrix
    type(frame_t), intent(out) :: frame
    integer, parameter :: one(6) = [1, 2, 3, 1, 1, 2], two(6) = [1, 2, 3, 2, 3, 3]
    real(wp) :: axes(3, 3), row(6)
    integer :: i

    call principal_values(matmul(transform, stress), frame%values, axes)
    if (.not. with_matrix) return
    do i = 1, 6
      associate (a => axes(:, one(i)), b => axes(:, two(i)))
        row(:3) = a*b
        row(4:) = [a(1)*b(2) + a(2)*b(1), a(1)*b(3) + a(3)*b(1), a(2)*b(3) + a(3)*b(2)]
        frame%matrix(i, :) = matmul(row, transform)
      end associate
    end do
  end subroutine new_frame

  !> x to the power m - `less`.
  elemental real(wp) function power(yield, less, x)
    type(principal_yield_t), intent(in) :: yield
    integer, intent(in) :: less
    real(wp), intent(in) :: x   !! >= 0

    if (yield%whole_exponent > 0) then
      power = x**(yield%whole_exponent - less)
    else
      power = x**(yield%exponent - less)
    end if
  end function power

  !> From the derivatives by principal values to those by stress: the values themselves, and
  !! the rotation of their axes with (slope_a - slope_b)/(value_a - value_b), which for equal
  !! values has a limit.
  pure subroutine second_derivatives(yield, q, frames, slopes, powers, hessian)
    type(principal_yield_t), intent(in) :: yield
    real(wp), intent(in) :: q, slopes(3, 2), powers(3, 3)   !! powers: to m - 2, of differences/q
    type(frame_t), intent(in) :: frames(2)
    real(wp), intent(out) :: hessian(5, 5)
    real(wp), parameter :: near = 1.0e-7_wp
    real(wp) :: by_values(6, 6), slope(6), stacked(6, 5), turn, scaling
    integer :: i, j, k, place

    scaling = (yield%exponent - 1.0_wp)/q
    slope = [slopes(:, 1), slopes(:, 2)]
    by_values = 0.0_wp
    by_values(:3, 4:) = -0.25_wp*scaling*powers
    by_values(4:, :3) = transpose(by_values(:3, 4:))
    do i = 1, 3
      by_values(i, i) = 0.25_wp*scaling*sum(powers(i, :))
      by_values(i + 3, i + 3) = 0.25_wp*scaling*sum(powers(:, i))
    end do
    do j = 1, 6
      by_values(:, j) = by_values(:, j) - scaling*slope*slope(j)
    end do
    stacked(:3, :) = frames(1)%matrix(:3, :)
    stacked(4:, :) = frames(2)%matrix(:3, :)
    hessian = matmul(transpose(stacked), matmul(by_values, stacked))
    if (yield%n_transforms == 1) then
      by_values(:3, :3) = by_values(:3, :3) + by_values(:3, 4:) + by_values(4:, :3) &
                          + by_values(4:, 4:)
      slope(:3) = slope(:3) + slope(4:)
    end if
    do k = 1, yield%n_transforms
      do place = 4, 6
        i = merge(1, 2, place < 6)
        j = merge(2, 3, place == 4)
        associate (values => frames(k)%values, at => 3*(k - 1))
          if (abs(values(i) - values(j)) > near*q) then
            turn = (slope(at + i) - slope(at + j))/(values(i) - values(j))
          else
            turn = 0.5_wp*(by_values(at + i, at + i) + by_values(at + j, at + j)) &
                   - by_values(at + i, at + j)
          end if
        end associate
        hessian = hessian + 2.0_wp*turn*spread(frames(k)%matrix(place, :), 1, 5) &
                  *spread(frames(k)%matrix(place, :), 2, 5)
      end do
    end do
  end subroutine second_derivatives

end module principal_yield
