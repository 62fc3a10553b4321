!> Hill's function in plane stress: from the modes of von Mises to its own and back.
!!
!! Its modes are those that keep apart both in the function and in isotropic elasticity, scaled so
!! that the sum of their squares is the square of the equivalent stress, see `plane_return`.
module hill_plane
  use kinds, only: wp
  use plane_stress, only: mode_moduli
  use symmetric_eigen, only: principal_values
  use yield_function, only: quadratic_t
  implicit none
  private

  public :: new_plane_hill, into_hill_modes, from_hill_modes

  !> Hill's function in a sheet whose normal is axis 3 of the material.
  type, public :: plane_hill_t
    real(wp) :: modes(3, 3) = 0.0_wp   !! as rows, in those of von Mises in the axes of the material
    real(wp) :: moduli(3) = 0.0_wp     !! elastic, the first is the smallest [stress]
  end type plane_hill_t

contains

  !> From Hill's function of deviators.
  pure function new_plane_hill(hill, bulk, shear) result(plane)
    type(quadratic_t), intent(in) :: hill
    real(wp), intent(in) :: bulk, shear
    type(plane_hill_t) :: plane
    real(wp) :: root(3), values(3), form(6), directions(3, 3)
    integer :: i, order(3)

    root = sqrt(mode_moduli(bulk, shear))
    ! Components 2, 1 and 3 of a deviator are the modes of von Mises, times the root of 2/3.
    form = 2.0_wp/3.0_wp*[hill%block(2, 2)*root(1)**2, hill%block(1, 1)*root(2)**2, &
                          hill%weights(3)*root(3)**2, hill%block(1, 2)*root(1)*root(2), &
                          0.0_wp, 0.0_wp]
    call principal_values(form, values, directions)
    order(1) = minloc(values, 1)
    order(2:) = pack([1, 2, 3], [1, 2, 3] /= order(1))
    plane%moduli = values(order)
    do i = 1, 3
      plane%modes(i, :) = sqrt(plane%moduli(i))*directions(:, order(i))/root
    end do
  end function new_plane_hill

  !> Modes of stresses.
  pure subroutine into_hill_modes(plane, n, axis, modes)
    type(plane_hill_t), intent(in) :: plane
    integer, intent(in) :: n
    real(wp), intent(in) :: axis(n, 2)        !! first one of the material in the frame
    real(wp), intent(inout) :: modes(n, 3)    !! of von Mises, out of Hill
    real(wp) :: cosine, sine, s1, s2, s3
    integer :: l

    associate (b => plane%modes)
      !$omp simd private(cosine, sine, s1, s2, s3)
      do l = 1, n
        cosine = axis(l, 1)**2 - axis(l, 2)**2
        sine = 2.0_wp*axis(l, 1)*axis(l, 2)
        s1 = modes(l, 1)
        s2 = cosine*modes(l, 2) + sine*modes(l, 3)
        s3 = cosine*modes(l, 3) - sine*modes(l, 2)
        modes(l, 1) = b(1, 1)*s1 + b(1, 2)*s2 + b(1, 3)*s3
        modes(l, 2) = b(2, 1)*s1 + b(2, 2)*s2 + b(2, 3)*s3
        modes(l, 3) = b(3, 1)*s1 + b(3, 2)*s2 + b(3, 3)*s3
      end do
    end associate
  end subroutine into_hill_modes

  !> Plastic strain of modes, in the modes of von Mises.
  pure subroutine from_hill_modes(plane, n, axis, modes)
    type(plane_hill_t), intent(in) :: plane
    integer, intent(in) :: n
    real(wp), intent(in) :: axis(n, 2)        !! as above
    real(wp), intent(inout) :: modes(n, 3)    !! of Hill, out of von Mises
    real(wp) :: cosine, sine, e2, e3
    integer :: l

    associate (b => plane%modes)
      !$omp simd private(cosine, sine, e2, e3)
      do l = 1, n
        cosine = axis(l, 1)**2 - axis(l, 2)**2
        sine = 2.0_wp*axis(l, 1)*axis(l, 2)
        e2 = b(1, 2)*modes(l, 1) + b(2, 2)*modes(l, 2) + b(3, 2)*modes(l, 3)
        e3 = b(1, 3)*modes(l, 1) + b(2, 3)*modes(l, 2) + b(3, 3)*modes(l, 3)
        modes(l, 1) = b(1, 1)*modes(l, 1) + b(2, 1)*modes(l, 2) + b(3, 1)*modes(l, 3)
        modes(l, 2) = cosine*e2 - sine*e3
        modes(l, 3) = sine*e2 + cosine*e3
      end do
    end associate
  end subroutine from_hill_modes

end module hill_plane
