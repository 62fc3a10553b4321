!> Mass scaling of the motion through the thickness.
!!
!! The control points along axis 3 form columns. Along the direction of a column, its motion is
!! split into the mean, weighted by mass, and the differences to it; the differences get a mass that
!! is larger by a factor. The mean keeps its mass, so linear momentum does not change, and no
!! system has to be solved: an acceleration a_n becomes mean + (a_n - mean)/factor. These
!! differences make the highest frequencies of a thin sheet, and they carry next to no energy.
module thickness_masses
  use kinds, only: wp
  implicit none
  private

  public :: column_directions, column_differences, shrink_differences, difference_masses
  public :: held_column_lag

contains

  !> Unit vectors from the first to the last control point of the columns, shape (n1, n2, 3).
  pure function column_directions(x) result(directions)
    real(wp), intent(in) :: x(:, :, :, :)     !! control points, (n1, n2, n3, 3)
    real(wp) :: directions(size(x, 1), size(x, 2), 3)
    real(wp) :: lengths(size(x, 1), size(x, 2))
    integer :: c

    directions = x(:, :, size(x, 3), :) - x(:, :, 1, :)
    lengths = max(norm2(directions, 3), tiny(1.0_wp))
    do c = 1, 3
      directions(:, :, c) = directions(:, :, c)/lengths
    end do
  end function column_directions

  !> Component of a field along the columns less its mean over the column, weighted by mass.
  pure function column_differences(mass, directions, field) result(differences)
    real(wp), intent(in) :: mass(:, :, :)             !! (n1, n2, n3)
    real(wp), intent(in) :: directions(:, :, :)       !! (n1, n2, 3)
    real(wp), intent(in) :: field(:, :, :, :)         !! (n1, n2, n3, 3)
    real(wp) :: differences(size(mass, 1), size(mass, 2), size(mass, 3))
    real(wp) :: mean(size(mass, 1), size(mass, 2)), total(size(mass, 1), size(mass, 2))
    integer :: k

    mean = 0.0_wp
    total = 0.0_wp
    do k = 1, size(mass, 3)
      differences(:, :, k) = directions(:, :, 1)*field(:, :, k, 1) &
                             + directions(:, :, 2)*field(:, :, k, 2) &
                             + directions(:, :, 3)*field(:, :, k, 3)
      mean = mean + mass(:, :, k)*differences(:, :, k)
      total = total + mass(:, :, k)
    end do
    mean = mean/total
    do k = 1, size(mass, 3)
      differences(:, :, k) = differences(:, :, k) - mean
    end do
  end function column_differences

  !> Take the share 1 - 1/scaling of the differences away from a field.
  pure subroutine shrink_differences(mass, directions, scaling, field)
    real(wp), intent(in) :: mass(:, :, :)             !! (n1, n2, n3)
    real(wp), intent(in) :: directions(:, :, :)       !! (n1, n2, 3)
    real(wp), intent(in) :: scaling(:, :)             !! (n1, n2)
    real(wp), intent(inout) :: field(:, :, :, :)      !! (n1, n2, n3, 3)
    real(wp) :: differences(size(mass, 1), size(mass, 2), size(mass, 3))
    integer :: k, c

    differences = column_differences(mass, directions, field)
    do c = 1, 3
      do k = 1, size(mass, 3)
        field(:, :, k, c) = field(:, :, k, c) - (1.0_wp - 1.0_wp/scaling)*directions(:, :, c) &
                            *differences(:, :, k)
      end do
    end do
  end subroutine shrink_differences

  !> By how much the scaled mass slows the points of a column down that supports hold in part: with
  !! the acceleration a that the scaled mass takes, (scaling - 1) times the difference of n.a to its
  !! mean. What must be added to the forces is minus that, times the masses, along the direction n.
  !! The mass matrix of the free components is one 3 x 3 block a point less one dyad of the column,
  !! so its inverse is known (J. Sherman and W. J. Morrison, Ann. Math. Stat. 21 (1950) 124).
  pure function held_column_lag(mass, direction, scaling, is_held, acceleration) result(lag)
    real(wp), intent(in) :: mass(:)                  !! of the points
    real(wp), intent(in) :: direction(3)             !! n, of length 1
    real(wp), intent(in) :: scaling                  !! above 1
    logical, intent(in) :: is_held(:, :)             !! components that supports hold, (n, 3)
    real(wp), intent(in) :: acceleration(:, :)       !! of these; elsewhere force over mass; (n, 3)
    real(wp) :: lag(size(mass))                      !! [length/time^2]
    real(wp) :: held(size(mass)), along(size(mass)), softness(size(mass)), total
    integer :: i

    total = sum(mass)
    do i = 1, size(mass)
      held(i) = sum(direction*acceleration(i, :), mask=is_held(i, :))
      along(i) = sum(direction*acceleration(i, :), mask=.not. is_held(i, :))
      softness(i) = sum(direction**2, mask=.not. is_held(i, :))
    end do
    along = along - (scaling - 1.0_wp)*softness*(held - sum(mass*held)/total)
    along = along/(1.0_wp + (scaling - 1.0_wp)*softness)
    softness = softness/(1.0_wp + (scaling - 1.0_wp)*softness)
    along = held + along + softness*(scaling - 1.0_wp)*sum(mass*along) &
                           /(total - (scaling - 1.0_wp)*sum(mass*softness))
    lag = (scaling - 1.0_wp)*(along - sum(mass*along)/total)
  end function held_column_lag

  !> Mass that moves in the differences of each column, shape (n1, n2): the trace of their mass
  !! matrix, sum m - (sum m^2)/(sum m).
  pure function difference_masses(mass) result(moving)
    real(wp), intent(in) :: mass(:, :, :)
    real(wp) :: moving(size(mass, 1), size(mass, 2))

    moving = sum(mass, 3) - sum(mass**2, 3)/sum(mass, 3)
  end function difference_masses

end module thickness_masses