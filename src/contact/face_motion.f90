!> Control points of a face now and at the call before: how they move against a tool.
module face_motion
  use kinds, only: wp
  use slave_surface, only: slave_surface_t, point_position
  implicit none
  private

  public :: face_motion_t, new_face_motion, take_turn, carry_rows, point_motion

  !> Two states of a face, one after the other; arrays by control point.
  type :: face_motion_t
    logical :: is_started = .false.            !! whether `now` holds a state
    real(wp) :: displacement(3) = 0.0_wp       !! of the tool now [length]
    real(wp) :: moved(3) = 0.0_wp              !! its motion since the state before [length]
    real(wp), allocatable :: now(:, :, :)      !! control points, shape (n1, n2, 3) [length]
    real(wp), allocatable :: before(:, :, :)   !! [length]
    real(wp), allocatable :: squares(:, :)     !! of their motions against the tool [length^2]
    real(wp), allocatable :: highest(:)        !! largest of these of each row [length^2]
  end type face_motion_t

contains

  !> No state yet.
  pure subroutine new_face_motion(motion, n)
    type(face_motion_t), intent(out) :: motion
    integer, intent(in) :: n(2)    !! control points

    allocate (motion%now(n(1), n(2), 3), motion%before(n(1), n(2), 3), source=0.0_wp)
    allocate (motion%squares(n(1), n(2)), motion%highest(n(2)), source=0.0_wp)
  end subroutine new_face_motion

  !> What was now is before; the first state knows no motion. `carry_rows` brings the new one.
  pure subroutine take_turn(motion, displacement, x)
    type(face_motion_t), intent(inout) :: motion
    real(wp), intent(in) :: displacement(3)   !! of the tool [length]
    real(wp), intent(in) :: x(:, :, :)        !! control points now [length]
    real(wp), allocatable :: room(:, :, :)

    if (motion%is_started) then
      motion%moved = displacement - motion%displacement
      call move_alloc(motion%before, room)
      call move_alloc(motion%now, motion%before)
      call move_alloc(room, motion%now)
    else
      motion%before = x
    end if
    motion%displacement = displacement
  end subroutine take_turn

  !> Take the control points; the threads of a region share their rows. Little is stored, as each
  !! store waits for memory that the elements have pushed out of the nearest cache.
  subroutine carry_rows(motion, x)
    type(face_motion_t), intent(inout) :: motion
    real(wp), intent(in) :: x(:, :, :)        !! control points now [length]
    integer :: j

    !$omp do schedule(static)
    do j = 1, size(motion%highest)
      call carry_row(size(motion%squares, 1), motion%moved, x(:, j, :), motion%before(:, j, :), &
                     motion%now(:, j, :), motion%squares(:, j))
      motion%highest(j) = maxval(motion%squares(:, j))
    end do
    !$omp end do
  end subroutine carry_rows

  !> One row.
  pure subroutine carry_row(n, moved, x, before, now, squares)
    integer, intent(in) :: n
    real(wp), intent(in) :: moved(3), x(:, :), before(:, :)
    real(wp), intent(inout) :: now(:, :)
    real(wp), intent(out) :: squares(n)
    integer :: i

    !$omp simd
    do i = 1, n
      now(i, 1) = x(i, 1)
      now(i, 2) = x(i, 2)
      now(i, 3) = x(i, 3)
      squares(i) = (x(i, 1) - before(i, 1) - moved(1))**2 + (x(i, 2) - before(i, 2) - moved(2))**2 &
                   + (x(i, 3) - before(i, 3) - moved(3))**2
    end do
  end subroutine carry_row

  !> Motion of the slave point (i, j) against the tool since the state before.
  pure function point_motion(motion, slave, i, j) result(way)
    type(face_motion_t), intent(in) :: motion
    type(slave_surface_t), intent(in) :: slave
    integer, intent(in) :: i, j
    real(wp) :: way(3)

    way = point_position(slave, motion%now, i, j) - point_position(slave, motion%before, i, j) &
          - motion%moved
  end function point_motion

end module face_motion
