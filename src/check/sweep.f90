!> The motion of a tool over the run: its position at any time, and the times at which its velocity
!! may jump.
module sweep
  use kinds, only: wp
  use tool, only: tool_t
  use rigid_motion, only: rigid_motion_t, move_tool, start_motion
  use model, only: model_t
  implicit none
  private

  public :: frame_t, path_t, path_of, position_at, break_times, in_space, in_tool, moved_by

  !> Where a tool is at a time: a point X of the tool is at rotation*X + displacement.
  type :: frame_t
    real(wp) :: time = 0.0_wp
    integer :: step = 1                       !! of the deck
    real(wp) :: displacement(3) = 0.0_wp
    real(wp) :: rotation(3, 3) = 0.0_wp
  end type frame_t

  !> Motions of a tool, one for each step of the deck, each begun where the last one ends.
  type :: path_t
    type(rigid_motion_t), allocatable :: motions(:)
    type(frame_t), allocatable :: starts(:)   !! of the steps
    real(wp) :: end_time = 0.0_wp
    logical :: is_still = .true.              !! it never moves, or nobody knows how far
    real(wp) :: shift(3) = 0.0_wp             !! added to all positions: way of a force to the sheet
  end type path_t

contains

  !> The path of a tool. A tool that a force moves stands still on it.
  function path_of(model, t) result(path)
    type(model_t), intent(in) :: model
    integer, intent(in) :: t                  !! number of the tool
    type(path_t) :: path
    type(tool_t) :: tool
    integer :: i, j, n

    n = 1 + size(model%later_steps)
    allocate (path%motions(n), path%starts(n))
    tool%displacement = model%bodies%tools(t)%displacement
    tool%rotation = model%bodies%tools(t)%rotation
    path%motions(1) = model%motions(t)
    path%end_time = model%step%duration
    path%starts(1) = frame_t(0.0_wp, 1, tool%displacement, tool%rotation)
    do i = 2, n
      call move_tool(path%motions(i - 1), path%end_time, 0.0_wp, tool)
      path%motions(i) = path%motions(i - 1)
      do j = 1, size(model%later_motions)
        if (model%later_motions(j)%tool /= t .or. model%later_motions(j)%step /= i) cycle
        path%motions(i) = model%later_motions(j)
        call start_motion(path%motions(i), path%end_time, tool)
      end do
      path%starts(i) = frame_t(path%end_time, i, tool%displacement, tool%rotation)
      path%end_time = path%end_time + model%later_steps(i - 1)%step%duration
    end do
    do i = 1, n
      do j = 1, size(path%motions(i)%terms)
        path%is_still = path%is_still .and. &
                        .not. any(abs(path%motions(i)%terms(j)%vector) > 0.0_wp)
      end do
    end do
  end function path_of

  !> Position at a time of the run.
  pure function position_at(path, time) result(frame)
    type(path_t), intent(in) :: path
    real(wp), intent(in) :: time
    type(frame_t) :: frame
    type(tool_t) :: tool
    integer :: i

    i = max(1, count(path%starts%time <= time))
    tool%displacement = path%starts(i)%displacement
    tool%rotation = path%starts(i)%rotation
    call move_tool(path%motions(i), time, 0.0_wp, tool)
    frame = frame_t(time, i, tool%displacement + path%shift, tool%rotation)
  end function position_at

  !> Rising times between which the velocity has no jump: those of steps and of all curves.
  pure function break_times(path) result(times)
    type(path_t), intent(in) :: path
    real(wp), allocatable :: times(:)
    real(wp) :: next
    integer :: i, k
    real(wp), allocatable :: all_times(:)

    all_times = [path%starts%time, path%end_time]
    do i = 1, size(path%motions)
      do k = 1, size(path%motions(i)%terms)
        associate (curve => path%motions(i)%terms(k)%curve)
          all_times = [all_times, curve%start + curve%times]
        end associate
      end do
    end do
    all_times = pack(all_times, all_times >= 0.0_wp .and. all_times <= path%end_time)
    allocate (times(0))
    next = 0.0_wp
    do
      times = [times, next]
      if (.not. any(all_times > next)) exit
      next = minval(all_times, all_times > next)
    end do
  end function break_times

  !> A point of the tool in space.
  pure function in_space(frame, x) result(place)
    type(frame_t), intent(in) :: frame
    real(wp), intent(in) :: x(3)
    real(wp) :: place(3)

    place = matmul(frame%rotation, x) + frame%displacement
  end function in_space

  !> A point in space in the frame of the tool.
  pure function in_tool(frame, x) result(place)
    type(frame_t), intent(in) :: frame
    real(wp), intent(in) :: x(3)
    real(wp) :: place(3)

    place = matmul(x - frame%displacement, frame%rotation)
  end function in_tool

  !> Largest displacement of a corner of the box around a tool between two positions [length].
  pure real(wp) function moved_by(tool, a, b) result(length)
    type(tool_t), intent(in) :: tool
    type(frame_t), intent(in) :: a, b
    real(wp) :: corner(3)
    integer :: i

    length = 0.0_wp
    do i = 0, 7
      corner = merge(tool%box(:, 1), tool%box(:, 2), [btest(i, 0), btest(i, 1), btest(i, 2)])
      length = max(length, norm2(in_space(b, corner) - in_space(a, corner)))
    end do
  end function moved_by

end module sweep
