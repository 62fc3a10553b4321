!> What a return mapping loses by long strain increments, and what it costs.
!!
!! A row of points is strained along paths whose direction turns all the way, and the stresses at
!! their ends are compared with those of very short increments.
module return_error
  use, intrinsic :: iso_fortran_env, only: int64
  use kinds, only: wp
  use failure, only: error_t, fail
  use timer, only: clock_ticks, ticks_to_seconds
  use block_law, only: block_law_t
  implicit none
  private

  public :: reference_stresses, time_paths, mean_error

  integer, parameter, public :: n_points = 24        !! of the row, as in a forming run
  real(wp), parameter, public :: path_length = 0.2_wp   !! equivalent strain of each path
  real(wp), parameter, public :: finest = 2.0e-5_wp     !! increment of the reference

contains

  !> Stresses at the ends of the paths after equal increments, about `increment` long.
  subroutine end_stresses(law, increment, stress, error)
    class(block_law_t), intent(in) :: law
    real(wp), intent(in) :: increment                    !! equivalent strain
    real(wp), intent(out) :: stress(n_points, 6)
    type(error_t), allocatable, intent(out) :: error
    real(wp), dimension(n_points, 6) :: first, last, dstrain
    real(wp) :: state(n_points, law%n_state), spin(n_points, 3), way
    integer :: i, n
    logical :: ok

    call draw_directions(first, last)
    n = max(1, nint(path_length/increment))
    stress = 0.0_wp
    state = 0.0_wp
    spin = 0.0_wp
    do i = 1, n
      way = (i - 0.5_wp)/n
      dstrain = ((1.0_wp - way)*first + way*last)*(path_length/n)
      call law%update(n_points, path_length/n, dstrain, stress, state, ok, spin)
      if (.not. ok) then
        call fail(error, "the return did not converge")
        return
      end if
    end do
  end subroutine end_stresses

  !> Stresses that short increments tend to: what two lengths give, extrapolated to zero with the
  !! first order of the method.
  subroutine reference_stresses(law, stress, error)
    class(block_law_t), intent(in) :: law                !! with the backward Euler return
    real(wp), intent(out) :: stress(n_points, 6)
    type(error_t), allocatable, intent(out) :: error
    real(wp) :: coarse(n_points, 6)

    stress = 0.0_wp
    call end_stresses(law, 2.0_wp*finest, coarse, error)
    if (.not. allocated(error)) call end_stresses(law, finest, stress, error)
    stress = 2.0_wp*stress - coarse
  end subroutine reference_stresses

  !> Mean over the points of |stress - reference|/|reference|, in the von Mises norm.
  pure real(wp) function mean_error(stress, reference)
    real(wp), intent(in) :: stress(n_points, 6), reference(n_points, 6)

    mean_error = sum(mises(stress - reference)/mises(reference))/n_points
  end function mean_error

  !> Stresses at the ends of the paths, and the time of the law for one point and increment. The
  !! paths are repeated until it is told well.
  subroutine time_paths(law, increment, stress, seconds, error)
    class(block_law_t), intent(in) :: law
    real(wp), intent(in) :: increment
    real(wp), intent(out) :: stress(n_points, 6), seconds
    type(error_t), allocatable, intent(out) :: error
    real(wp), parameter :: least = 0.03_wp   ! [s], of a measurement
    real(wp) :: elapsed
    integer(int64) :: started
    integer :: n_repeats

    n_repeats = 0
    elapsed = 0.0_wp
    started = clock_ticks()
    do while (elapsed < least)
      call end_stresses(law, increment, stress, error)
      if (allocated(error)) exit
      n_repeats = n_repeats + 1
      elapsed = ticks_to_seconds(clock_ticks() - started)
    end do
    seconds = elapsed/(real(max(n_repeats, 1), wp)*n_points*max(1, nint(path_length/increment)))
  end subroutine time_paths

  pure function mises(stress) result(norm)
    real(wp), intent(in) :: stress(n_points, 6)
    real(wp) :: norm(n_points)

    norm = sqrt(0.5_wp*((stress(:, 1) - stress(:, 2))**2 + (stress(:, 2) - stress(:, 3))**2 &
                        + (stress(:, 3) - stress(:, 1))**2) + 3.0_wp*sum(stress(:, 4:)**2, 2))
  end function mises

  !> Strain directions at the starts and ends of the paths: no change of volume, unit equivalent
  !! strain, spread over all directions by a sequence that is the same on each machine.
  pure subroutine draw_directions(first, last)
    real(wp), dimension(n_points, 6), intent(out) :: first, last
    integer, parameter :: factor = 16807, quotient = 127773, rest = 2836, period = huge(1)
    real(wp) :: e(6)
    integer :: l, k, seed, which

    ! S. K. Park and K. W. Miller, Commun. ACM 31 (1988).
    seed = 1
    do which = 1, 2
      do l = 1, n_points
        do k = 1, 6
          seed = factor*mod(seed, quotient) - rest*(seed/quotient)
          if (seed <= 0) seed = seed + period
          e(k) = 2.0_wp*real(seed, wp)/period - 1.0_wp
        end do
        e(:3) = e(:3) - sum(e(:3))/3.0_wp
        e = e/sqrt(2.0_wp/3.0_wp*(sum(e(:3)**2) + 0.5_wp*sum(e(4:)**2)))
        if (which == 1) first(l, :) = e
        if (which == 2) last(l, :) = e
      end do
    end do
  end subroutine draw_directions

end module return_error
