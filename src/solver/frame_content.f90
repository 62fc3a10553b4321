!> What a frame of the results holds of a run: control points, point fields, tools, contact.
module frame_content
  use kinds, only: wp
  use tool, only: tool_t
  use model, only: model_t
  use frames, only: frame_t, face_field_t, tool_frame_t
  use contact_effect, only: contact_view_t, contact_pairs
  use contact_fields, only: face_pressure, set_tool_pressure
  use history_columns, only: turning_tools
  implicit none
  private

  public :: new_frame, fill_frame

contains

  !> A frame with room for the fields of the model.
  subroutine new_frame(model, frame)
    type(model_t), intent(in) :: model
    type(frame_t), intent(out) :: frame
    integer :: q(3), n(3), n_tools, n_shown, p

    n_tools = size(model%bodies%tools)
    n_shown = model%bodies%blank%law%n_state - model%bodies%blank%law%n_hidden
    allocate (frame%patches(size(model%bodies%blank%parts)))
    do p = 1, size(frame%patches)
      associate (body => model%bodies%blank%parts(p)%element, fields => frame%patches(p))
        q = body%rule%n
        n = body%n_elements
        allocate (fields%points, fields%velocity, mold=body%motion%x)
        allocate (fields%eqps(q(1), q(2), q(3), n(1), n(2), n(3)), source=0.0_wp)
        allocate (fields%stress(6, q(1), q(2), q(3), n(1), n(2), n(3)))
        allocate (fields%state(n_shown, q(1), q(2), q(3), n(1), n(2), n(3)))
      end associate
    end do
    allocate (frame%tool_displacement(3, n_tools), frame%tool_velocity(3, n_tools))
    if (.not. any(turning_tools(model))) return
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
    do p = 1, size(frame%patches)
      frame%patches(p)%points = model%bodies%blank%parts(p)%element%motion%x
      frame%patches(p)%velocity = model%bodies%blank%parts(p)%element%motion%v
      associate (fields => frame%patches(p))
        call model%bodies%blank%parts(p)%element%read_points( &
          model%bodies%blank%law%eqps_state, fields%eqps, fields%stress, fields%state)
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
    integer :: p

    do p = 1, size(frame%patches)
      if (allocated(frame%patches(p)%contacts)) deallocate (frame%patches(p)%contacts)
      allocate (frame%patches(p)%contacts(0))
    end do
    if (allocated(frame%tool_fields)) deallocate (frame%tool_fields)
    allocate (frame%tool_fields(0))
    call add_contact_fields([contact_pairs(model%forces), contact_pairs(model%retired)], &
                            model%bodies%tools, frame)
  end subroutine fill_contact_fields

  subroutine add_contact_fields(pairs, tools, frame)
    type(contact_view_t), intent(in) :: pairs(:)
    type(tool_t), intent(in) :: tools(:)
    type(frame_t), intent(inout) :: frame
    type(tool_frame_t) :: on_tool
    type(face_field_t) :: on_face
    integer :: i, s

    do i = 1, size(pairs)
      associate (pair => pairs(i)%pair)
        associate (tool => tools(pair%tool), contacts => frame%patches(pair%part))
          call face_pressure(pair%fields, pair%pair, tool, contacts%points( &
            pair%lower(1):pair%upper(1), pair%lower(2):pair%upper(2), &
            pair%lower(3):pair%upper(3), :), on_face%grid, on_face%pressure)
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
  end subroutine add_contact_fields

end module frame_content
