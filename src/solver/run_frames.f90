!> The frames of a run: filled from the model, kept until the state after them is verified, and
!! written.
module run_frames
  use kinds, only: wp
  use model, only: model_t
  use frames, only: frame_t, face_field_t, tool_frame_t, results_t, write_frame
  use contact_effect, only: contact_view_t, contact_pairs, net_of_pair
  use contact_fields, only: face_pressure, set_tool_pressure
  use history_columns, only: rotating_tools
  use failure, only: error_t
  use ranks, only: is_first
  use timer, only: start_watch, stop_watch
  use run_state, only: run_t
  implicit none
  private

  public :: new_frame, fill_frame
  public :: add_frame, release_frames

contains

  !> A frame with room for the fields of the model.
  subroutine new_frame(model, frame)
    type(model_t), intent(in) :: model
    type(frame_t), intent(out) :: frame
    integer :: q(3), n(3), n_tools, n_shown, p

    n_tools = size(model%bodies%tools)
    n_shown = model%bodies%blank%law%n_state - model%bodies%blank%law%n_hidden
    if (.not. is_first(model%ranks)) return   ! who writes them; others count them
    allocate (frame%patches(size(model%bodies%blank%parts)))
    do p = 1, size(frame%patches)
      associate (body => model%bodies%blank%parts(p)%element, fields => frame%patches(p))
        q = body%rule%n
        n = body%n_elements
        allocate (fields%eqps(q(1), q(2), q(3), n(1), n(2), n(3)), source=0.0_wp)
        allocate (fields%stress(6, q(1), q(2), q(3), n(1), n(2), n(3)))
        allocate (fields%state(n_shown, q(1), q(2), q(3), n(1), n(2), n(3)))
        if (model%output%has_resultants) allocate (fields%resultants(6, q(1), q(2), n(1), n(2)))
      end associate
    end do
    allocate (frame%tool_displacement(3, n_tools), frame%tool_velocity(3, n_tools))
    if (.not. any(rotating_tools(model))) return
    allocate (frame%tool_turn(3, 3, n_tools), frame%tool_turn_rate(3, 3, n_tools))
  end subroutine new_frame

  !> Fields now; point fields in natural order.
  subroutine fill_frame(model, time, frame)
    type(model_t), intent(inout) :: model
    real(wp), intent(in) :: time
    type(frame_t), intent(inout) :: frame
    real(wp), parameter :: one(3, 3) = reshape([1, 0, 0, 0, 1, 0, 0, 0, 1], [3, 3])
    integer :: t, p

    frame%time = time
    frame%process_step = model%i_step
    if (.not. is_first(model%ranks)) return   ! who writes them; others count them
    do p = 1, size(frame%patches)
      call model%bodies%blank%parts(p)%element%body_motion(frame%patches(p)%points, &
                                                           frame%patches(p)%velocity)
      associate (fields => frame%patches(p))
        call model%bodies%blank%parts(p)%element%read_points( &
          model%bodies%blank%law%eqps_state, fields%eqps, fields%stress, fields%state)
        if (allocated(model%bodies%blank%parts(p)%element%edge_distance)) &
          fields%edge_distance = model%bodies%blank%parts(p)%element%edge_distance
        if (allocated(model%bodies%blank%parts(p)%element%ties%share)) then
          fields%share = model%bodies%blank%parts(p)%element%ties%share
          fields%places = model%bodies%blank%parts(p)%element%places_of_cut()
        end if
        if (allocated(model%bodies%blank%parts(p)%element%regions)) &
          fields%regions = model%bodies%blank%parts(p)%element%regions
        if (allocated(fields%resultants)) &
          call model%bodies%blank%parts(p)%element%read_resultants(fields%resultants)
      end associate
    end do
    do t = 1, size(model%bodies%tools)
      frame%tool_displacement(:, t) = model%bodies%tools(t)%displacement
      frame%tool_velocity(:, t) = model%bodies%tools(t)%velocity
      if (.not. allocated(frame%tool_turn)) cycle
      frame%tool_turn(:, :, t) = model%bodies%tools(t)%rotation - one
      frame%tool_turn_rate(:, :, t) = model%bodies%tools(t)%rotation_rate
    end do
    if (model%output%has_pressure) call fill_contact_fields(model, frame)
  end subroutine fill_frame

  !> Pressure and wear of all contact pairs; those of earlier steps have left their wear.
  subroutine fill_contact_fields(model, frame)
    type(model_t), intent(inout), target :: model
    type(frame_t), intent(inout) :: frame
    type(contact_view_t), allocatable :: pairs(:)
    type(tool_frame_t) :: on_tool
    type(face_field_t) :: on_face
    real(wp), allocatable :: net(:, :, :)
    integer :: i, p, s

    do p = 1, size(frame%patches)
      if (allocated(frame%patches(p)%contacts)) deallocate (frame%patches(p)%contacts)
      allocate (frame%patches(p)%contacts(0))
    end do
    if (allocated(frame%tool_fields)) deallocate (frame%tool_fields)
    allocate (frame%tool_fields(0))
    pairs = [contact_pairs(model%forces), contact_pairs(model%retired)]
    do i = 1, size(pairs)
      associate (pair => pairs(i)%pair)
        associate (tool => model%bodies%tools(pair%tool), contacts => frame%patches(pair%part))
          call net_of_pair(pair, model%bodies%blank%parts, net)
          call face_pressure(pair%fields, pair%pair, tool, net, on_face%grid, on_face%pressure)
          on_face%face = pair%fields%face
          contacts%contacts = [contacts%contacts, on_face]
          call set_tool_pressure(pair%fields, pair%pair, tool)
        end associate
        on_tool%tool = pair%tool
        do s = 1, size(pair%fields%tools)
          on_tool%surface = s
          on_tool%grid = pair%fields%tools(s)%grid
          on_tool%pressure = pair%fields%tools(s)%pressure
          if (pair%fields%has_wear) on_tool%wear = pair%fields%tools(s)%wear
          frame%tool_fields = [frame%tool_fields, on_tool]
        end do
      end associate
    end do
  end subroutine fill_contact_fields

  !> Fill one more, which waits after those that do.
  subroutine add_frame(model, run)
    type(model_t), intent(inout) :: model
    type(run_t), intent(inout) :: run
    type(frame_t), allocatable :: wider(:)
    integer :: i, n

    n = size(run%frames)
    if (run%n_waiting == n) then
      allocate (wider(2*n))
      do i = 1, 2*n
        wider(i) = run%frames(min(i, n))
      end do
      call move_alloc(wider, run%frames)
    end if
    run%n_waiting = run%n_waiting + 1
    call fill_frame(model, run%instant%time, run%frames(run%n_waiting))
  end subroutine add_frame

  !> Write the first of the frames, and the history, or its first rows.
  subroutine release_frames(model, run, results, n, error, n_samples)
    type(model_t), intent(inout) :: model         !! its timer alone
    type(run_t), intent(inout) :: run
    type(results_t), intent(inout) :: results
    integer, intent(in) :: n                      !! how many; none: nothing is written
    type(error_t), allocatable, intent(out) :: error
    integer, intent(in), optional :: n_samples       !! absent: all that wait
    integer :: i, n_rows

    if (n == 0) return
    n_rows = huge(n_rows)
    if (present(n_samples)) n_rows = n_samples
    call start_watch(model%timer, run%watch_output)
    do i = 1, n
      call write_frame(results, run%frames(i), error, merge(n_rows, 0, i == 1))
      if (allocated(error)) exit
    end do
    run%n_waiting = run%n_waiting - n
    do i = 1, run%n_waiting
      run%frames(i) = run%frames(i + n)
    end do
    run%is_file_lost = allocated(error)
    call stop_watch(model%timer, run%watch_output)
  end subroutine release_frames

end module run_frames
