!> The motion of a tool as a row of positions.
module sweep
  use kinds, only: wp
  use tool, only: tool_t
  use rigid_motion, only: rigid_motion_t, move_tool, start_motion
  use model, only: model_t
  implicit none
  private

  public :: frame_t, frames_of, in_space, in_tool

  !> Where a tool is at a time: a point X of the tool is at rotation*X + displacement.
  type :: frame_t
    real(wp) :: time = 0.0_wp
    integer :: step = 1                       !! of the deck
    real(wp) :: displacement(3) = 0.0_wp
    real(wp) :: rotation(3, 3) = 0.0_wp
  end type frame_t

  integer, parameter :: n_frames = 32         !! in each step of the deck

contains

  !> Positions of a tool over the run. A tool that stands still has one; so has one that a force
  !! moves, for nobody knows yet how far.
  function frames_of(model, t) result(frames)
    type(model_t), intent(in) :: model
    integer, intent(in) :: t                  !! number of the tool
    type(frame_t), allocatable :: frames(:)
    type(frame_t) :: next
    type(rigid_motion_t) :: motion
    type(tool_t) :: tool
    real(wp) :: start, duration
    integer :: i, j, k

    associate (now => model%bodies%tools(t))
      tool%displacement = now%displacement
      tool%rotation = now%rotation
    end associate
    motion = model%motions(t)
    start = 0.0_wp
    allocate (frames(0))
    do i = 1, 1 + size(model%later_steps)
      duration = model%step%duration
      if (i > 1) duration = model%later_steps(i - 1)%step%duration
      do j = 1, size(model%later_motions)
        if (i == 1) exit
        if (model%later_motions(j)%tool /= t .or. model%later_motions(j)%step /= i) cycle
        motion = model%later_motions(j)
        call start_motion(motion, start, tool)
      end do
      do k = merge(0, 1, i == 1), n_frames
        next%time = start + duration*k/n_frames
        call move_tool(motion, next%time, 0.0_wp, tool)
        next%step = i
        next%displacement = tool%displacement
        next%rotation = tool%rotation
        if (is_new(frames, next)) frames = [frames, next]
      end do
      start = start + duration
    end do
  end function frames_of

  !> Does a position differ from the last of a list?
  pure logical function is_new(frames, next)
    type(frame_t), intent(in) :: frames(:), next

    is_new = size(frames) == 0
    if (is_new) return
    associate (last => frames(size(frames)))
      is_new = any(abs(next%displacement - last%displacement) > 0.0_wp) .or. &
               any(abs(next%rotation - last%rotation) > 0.0_wp)
    end associate
  end function is_new

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

end module sweep
