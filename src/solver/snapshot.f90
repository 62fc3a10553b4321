!> The state of a run as the results file wants it: frames and history rows.
module snapshot
  use kinds, only: wp
  use body_parts, only: field_t
  use tool, only: tool_t
  use model, only: model_t
  use tool_turn, only: way_of
  use frames, only: frame_t, face_field_t, tool_frame_t
  use contact_effect, only: contact_effect_t, contact_view_t, contact_pairs
  use contact_fields, only: face_pressure, set_tool_pressure
  use history, only: history_row_t
  use knot_vector, only: find_span, basis_derivatives
  use nurbs_solid, only: nurbs_solid_t
  use energy_balance, only: energy_balance_t
  implicit none
  private

  public :: new_frame, fill_frame, new_history_row, fill_history_row

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
    if (.not. any(model%bodies%tools%is_turning)) return
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

  !> A history row with room for the tools and probes of the model.
  subroutine new_history_row(model, row)
    type(model_t), intent(in) :: model
    type(history_row_t), intent(out) :: row

    associate (n_tools => size(model%bodies%tools), n_probes => size(model%probes))
      allocate (row%tool_displacement(3, n_tools), row%tool_force(3, n_tools), &
                row%tool_torque(3, n_tools))
      allocate (row%probe_displacement(3, n_probes), row%probe_velocity(3, n_probes))
    end associate
  end subroutine new_history_row

  !> Balances, tools and probes now.
  subroutine fill_history_row(model, balance, elastic, v, row)
    type(model_t), intent(in) :: model
    type(energy_balance_t), intent(in) :: balance
    real(wp), intent(in) :: elastic           !! elastic energy now
    type(field_t), intent(in) :: v(:)         !! velocities now, not those half a step on;
                                              !! may be none without probes
    type(history_row_t), intent(inout) :: row
    real(wp) :: start(3)
    integer :: t, p

    row%process_step = model%i_step
    row%kinetic_energy = balance%kinetic
    row%internal_energy = balance%internal
    row%plastic_work = balance%internal - elastic
    row%viscous_energy = balance%viscous
    row%damping_energy = balance%tally%damping_energy
    row%added_mass = model%bodies%blank%added_mass
    row%contact_energy = balance%tally%contact_energy
    row%friction_energy = balance%tally%friction_energy
    row%external_work = balance%tally%external_work
    row%max_penetration = balance%tally%max_penetration
    row%energy_error = balance%error
    row%momentum = balance%momentum
    row%angular_momentum = balance%angular_momentum
    do t = 1, size(model%bodies%tools)
      row%tool_displacement(:, t) = way_of(model%bodies%tools(t))
      row%tool_force(:, t) = model%bodies%tools(t)%force
      row%tool_torque(:, t) = model%bodies%tools(t)%torque
    end do
    if (model%width_ratio > 1.0_wp) call widen_row(model%width_ratio, row)
    do p = 1, size(model%probes)
      associate (body => model%bodies%blank%parts(model%probes(p)%patch)%element)
        start = field_at(body%grid, body%grid%points, model%probes(p)%xi)
        row%probe_displacement(:, p) = field_at(body%grid, body%motion%x, &
                                                model%probes(p)%xi) - start
        row%probe_velocity(:, p) = field_at(body%grid, v(model%probes(p)%patch)%values, &
                                            model%probes(p)%xi)
      end associate
    end do
  end subroutine fill_history_row

  !> From a strip to the full width.
  pure subroutine widen_row(ratio, row)
    real(wp), intent(in) :: ratio
    type(history_row_t), intent(inout) :: row

    row%kinetic_energy = ratio*row%kinetic_energy
    row%internal_energy = ratio*row%internal_energy
    row%plastic_work = ratio*row%plastic_work
    row%viscous_energy = ratio*row%viscous_energy
    row%damping_energy = ratio*row%damping_energy
    row%contact_energy = ratio*row%contact_energy
    row%friction_energy = ratio*row%friction_energy
    row%external_work = ratio*row%external_work
    row%added_mass = ratio*row%added_mass
    row%momentum = ratio*row%momentum
    row%angular_momentum = ratio*row%angular_momentum
    row%tool_force = ratio*row%tool_force
    row%tool_torque = ratio*row%tool_torque
  end subroutine widen_row

  !> Value of a control-point field at a parametric point.
  pure function field_at(solid, field, xi) result(value)
    type(nurbs_solid_t), intent(in) :: solid
    real(wp), intent(in) :: field(:, :, :, :), xi(3)
    real(wp) :: value(3), total, share
    real(wp) :: basis(maxval(solid%axes%degree) + 1, 3)
    integer :: axis, first(3), i, j, k, span

    do axis = 1, 3
      associate (kv => solid%axes(axis))
        span = find_span(kv, xi(axis))
        call basis_derivatives(kv, span, xi(axis), 0, basis(:kv%degree + 1, axis))
        first(axis) = span - kv%degree - 1
      end associate
    end do
    value = 0.0_wp
    total = 0.0_wp
    do k = 1, solid%axes(3)%degree + 1
      do j = 1, solid%axes(2)%degree + 1
        do i = 1, solid%axes(1)%degree + 1
          share = basis(i, 1)*basis(j, 2)*basis(k, 3) &
                  *solid%weights(first(1) + i, first(2) + j, first(3) + k)
          value = value + share*field(first(1) + i, first(2) + j, first(3) + k, :)
          total = total + share
        end do
      end do
    end do
    value = value/total
  end function field_at

end module snapshot
