!> The state of a run as the results file wants it: frames and history rows.
module snapshot
  use, intrinsic :: iso_fortran_env, only: int64
  use kinds, only: wp
  use body_parts, only: field_t
  use tool, only: tool_t
  use effect, only: instant_t
  use model, only: model_t
  use tool_turn, only: way_of
  use frames, only: frame_t, face_field_t, tool_frame_t
  use contact_effect, only: contact_view_t, contact_pairs, depth_of
  use contact_fields, only: face_pressure, set_tool_pressure
  use history, only: history_row_t, begin_row, enter
  use knot_vector, only: find_span, basis_derivatives
  use nurbs_solid, only: nurbs_solid_t
  use energy_balance, only: energy_balance_t
  implicit none
  private

  public :: new_frame, fill_frame, first_history_row, fill_history_row

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

  !> The columns of the history: balances, then tools, then history points. One line enters a
  !! quantity. Sums over a strip are those of the full width.
  subroutine fill_history_row(model, balance, instant, n_steps, v, elastic, row)
    type(model_t), intent(in) :: model
    type(energy_balance_t), intent(in) :: balance
    type(instant_t), intent(in) :: instant
    integer(int64), intent(in) :: n_steps     !! done
    type(field_t), intent(in) :: v(:)         !! velocities now, not those half a step on;
                                              !! may be none without probes
    real(wp), intent(in) :: elastic           !! elastic energy now
    type(history_row_t), intent(inout) :: row

    call begin_row(row)
    associate (ratio => model%width_ratio, tally => balance%tally)
      call enter(row, "/history/step", n_steps, "number of steps done")
      call enter(row, "/history/process_step", int(model%i_step, int64), &
                 "step of the deck, from 1 on")
      call enter(row, "/history/time", instant%time, "time", "time")
      call enter(row, "/history/dt", instant%dt, "time", "length of the last step")
      call enter(row, "/history/kinetic_energy", ratio*balance%kinetic, "energy", &
                 "kinetic energy of the blank")
      call enter(row, "/history/internal_energy", ratio*balance%internal, "energy", &
                 "work of the stresses since the start")
      call enter(row, "/history/plastic_work", ratio*(balance%internal - elastic), "energy", &
                 "dissipated part of it")
      call enter(row, "/history/contact_energy", ratio*tally%contact_energy, "energy", &
                 "work done against the contact springs")
      call enter(row, "/history/friction_energy", ratio*tally%friction_energy, "energy", &
                 "work done against friction")
      call enter(row, "/history/viscous_energy", ratio*balance%viscous, "energy", &
                 "work done against bulk viscosity")
      call enter(row, "/history/damping_energy", ratio*tally%damping_energy, "energy", &
                 "work done against damping")
      call enter(row, "/history/external_work", ratio*tally%external_work, "energy", &
                 "work of tools, loads and prescribed motion")
      call enter(row, "/history/energy_error", balance%error, "1", "balance of all energies "// &
                 "over the largest of initial energy, |external work| and kinetic + internal "// &
                 "energy")
      call enter(row, "/history/max_penetration", tally%max_penetration, "length", "largest "// &
                 "depth of a contact point of the blank in a tool since the row before")
      call enter(row, "/history/true_penetration", depth_of(model%forces), "length", "depth "// &
                 "of the deepest place of the blank in a tool now, between contact points too")
      call enter(row, "/history/added_mass", ratio*model%bodies%blank%added_mass, "mass", &
                 "mass added by scaling; of scaling through the thickness a third of the "// &
                 "trace of the added mass matrix")
      call enter(row, "/history/momentum", ratio*balance%momentum, "momentum", &
                 "linear momentum of the blank")
      call enter(row, "/history/angular_momentum", ratio*balance%angular_momentum, &
                 "angular momentum", "angular momentum of the blank about the origin, without "// &
                 "added mass")
    end associate
    call enter_tools(model, row)
    call enter_probes(model, v, row)
  end subroutine fill_history_row

  subroutine enter_tools(model, row)
    type(model_t), intent(in) :: model
    type(history_row_t), intent(inout) :: row
    logical :: is_turning(size(model%bodies%tools))
    integer :: t

    is_turning = turning_tools(model)
    do t = 1, size(model%bodies%tools)
      associate (tool => model%bodies%tools(t), ratio => model%width_ratio, &
                 folder => "/tools/"//model%bodies%tools(t)%name)
        call enter(row, folder//"/displacement", way_of(tool), "length", &
                   "displacement of the tool from its place at the start")
        call enter(row, folder//"/force", ratio*tool%force, "force", &
                   "force of the blank on the tool")
        if (is_turning(t)) call enter(row, folder//"/torque", ratio*tool%torque, "moment", &
                   "moment of this force about the point on the axis that the deck gives, "// &
                   "which goes with the tool; its part along the axis turns the tool")
      end associate
    end do
  end subroutine enter_tools

  subroutine enter_probes(model, v, row)
    type(model_t), intent(in) :: model
    type(field_t), intent(in) :: v(:)         !! velocities now, by patch
    type(history_row_t), intent(inout) :: row
    integer :: p

    do p = 1, size(model%probes)
      associate (probe => model%probes(p), folder => "/history/probes/"//model%probes(p)%name, &
                 body => model%bodies%blank%parts(model%probes(p)%patch)%element)
        call enter(row, folder//"/displacement", field_at(body%grid, body%motion%x, probe%xi) &
                   - field_at(body%grid, body%grid%points, probe%xi), "length", &
                   "displacement of the probe")
        call enter(row, folder//"/velocity", field_at(body%grid, v(probe%patch)%values, &
                   probe%xi), "velocity", "velocity of the probe")
      end associate
    end do
  end subroutine enter_probes

  !> The history row of a model that has not begun, for its columns.
  function first_history_row(model) result(row)
    type(model_t), intent(in) :: model
    type(history_row_t) :: row
    type(field_t) :: v(size(model%bodies%blank%parts))
    type(energy_balance_t) :: balance
    integer :: p

    do p = 1, size(v)
      v(p)%values = model%bodies%blank%parts(p)%element%motion%v
    end do
    call fill_history_row(model, balance, instant_t(), 0_int64, v, 0.0_wp, row)
  end function first_history_row

  !> Which tools turn in some step of the deck.
  pure function turning_tools(model) result(is_turning)
    type(model_t), intent(in) :: model
    logical :: is_turning(size(model%bodies%tools))
    integer :: i

    is_turning = model%bodies%tools%is_turning
    do i = 1, size(model%motions)
      is_turning(i) = is_turning(i) .or. any(model%motions(i)%terms%is_rotation)
    end do
    do i = 1, size(model%later_motions)
      associate (motion => model%later_motions(i))
        if (any(motion%terms%is_rotation)) is_turning(motion%tool) = .true.
      end associate
    end do
  end function turning_tools

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
