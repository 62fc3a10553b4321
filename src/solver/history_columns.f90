!> The columns of the history: each is entered by one call, with path, value, quantity and meaning.
module history_columns
  use, intrinsic :: iso_fortran_env, only: int64
  use kinds, only: wp
  use body_parts, only: field_t
  use tool, only: travel_of
  use history, only: history_sample_t, begin_sample, enter
  use contact_effect, only: depth_of
  use knot_vector, only: find_span, basis_derivatives
  use nurbs_solid, only: nurbs_solid_t
  use energy_balance, only: energy_balance_t
  use effect, only: instant_t
  use model, only: model_t
  implicit none
  private

  public :: first_history_sample, fill_history_sample, rotating_tools

contains

  !> The columns of the history: balances, then tools, then history points. One line enters a
  !! quantity. Sums over a strip are those of the full width.
  subroutine fill_history_sample(model, balance, instant, n_steps, v, elastic, sample)
    type(model_t), intent(in) :: model
    type(energy_balance_t), intent(in) :: balance
    type(instant_t), intent(in) :: instant
    integer(int64), intent(in) :: n_steps     !! done
    type(field_t), intent(in) :: v(:)         !! velocities now, not those half a step on;
                                              !! may be none without history points
    real(wp), intent(in) :: elastic           !! elastic energy now
    type(history_sample_t), intent(inout) :: sample

    call begin_sample(sample)
    associate (ratio => model%width_ratio, tally => balance%tally)
      call enter(sample, "/history/step", n_steps, "number of steps done")
      call enter(sample, "/history/process_step", int(model%i_step, int64), &
                 "step of the deck, from 1 on")
      call enter(sample, "/history/time", instant%time, "time", "time")
      call enter(sample, "/history/dt", instant%dt, "time", "length of the last step")
      call enter(sample, "/history/kinetic_energy", ratio*balance%kinetic, "energy", &
                 "kinetic energy of the blank")
      call enter(sample, "/history/internal_energy", ratio*balance%internal, "energy", &
                 "work of the stresses since the start")
      call enter(sample, "/history/plastic_work", ratio*(balance%internal - elastic), "energy", &
                 "dissipated part of it")
      call enter(sample, "/history/contact_energy", ratio*tally%contact_energy, "energy", &
                 "work done against the contact springs")
      call enter(sample, "/history/friction_energy", ratio*tally%friction_energy, "energy", &
                 "work done against friction")
      call enter(sample, "/history/viscous_energy", ratio*balance%viscous, "energy", &
                 "work done against bulk viscosity")
      call enter(sample, "/history/damping_energy", ratio*tally%damping_energy, "energy", &
                 "work done against damping")
      call enter(sample, "/history/external_work", ratio*tally%external_work, "energy", &
                 "work of tools, loads and prescribed motion")
      call enter(sample, "/history/energy_error", balance%error, "1", "balance of all energies "// &
                 "over the largest of initial energy, |external work| and kinetic + internal "// &
                 "energy")
      call enter(sample, "/history/max_penetration", tally%max_penetration, "length", "largest "// &
                 "penetration of a contact point of the blank since the previous sample")
      call enter(sample, "/history/true_penetration", depth_of(model%forces), "length", &
                 "largest penetration of the blank into a tool now, between contact points too")
      call enter(sample, "/history/added_mass", ratio*model%bodies%blank%added_mass, "mass", &
                 "mass added by scaling; of scaling through the thickness a third of the "// &
                 "trace of the added mass matrix")
      call enter(sample, "/history/momentum", ratio*balance%momentum, "momentum", &
                 "linear momentum of the blank")
      call enter(sample, "/history/angular_momentum", ratio*balance%angular_momentum, &
                 "angular momentum", "angular momentum of the blank about the origin, without "// &
                 "added mass")
    end associate
    call enter_tools(model, sample)
    call enter_history_points(model, v, sample)
  end subroutine fill_history_sample

  subroutine enter_tools(model, sample)
    type(model_t), intent(in) :: model
    type(history_sample_t), intent(inout) :: sample
    logical :: is_turning(size(model%bodies%tools))
    integer :: t

    is_turning = rotating_tools(model)
    do t = 1, size(model%bodies%tools)
      associate (tool => model%bodies%tools(t), ratio => model%width_ratio, &
                 folder => "/tools/"//model%bodies%tools(t)%name)
        call enter(sample, folder//"/displacement", travel_of(tool), "length", &
                   "displacement of the tool since the start")
        call enter(sample, folder//"/force", ratio*tool%force, "force", &
                   "force of the blank on the tool")
        if (is_turning(t)) call enter(sample, folder//"/torque", ratio*tool%torque, "moment", &
                   "moment of this force about the point on the axis that the deck gives, "// &
                   "which moves with the tool; its part along the axis rotates the tool")
      end associate
    end do
  end subroutine enter_tools

  subroutine enter_history_points(model, v, sample)
    type(model_t), intent(in) :: model
    type(field_t), intent(in) :: v(:)         !! velocities now, by patch
    type(history_sample_t), intent(inout) :: sample
    integer :: p

    do p = 1, size(model%probes)
      associate (probe => model%probes(p), folder => "/history/probes/"//model%probes(p)%name, &
                 body => model%bodies%blank%parts(model%probes(p)%patch)%element)
        call enter(sample, folder//"/displacement", field_at(body%grid, body%motion%x, probe%xi) &
                   - field_at(body%grid, body%grid%points, probe%xi), "length", &
                   "displacement of the history point")
        call enter(sample, folder//"/velocity", field_at(body%grid, v(probe%patch)%values, &
                   probe%xi), "velocity", "velocity of the history point")
      end associate
    end do
  end subroutine enter_history_points

  !> The history sample of a model that has not begun, for its columns.
  function first_history_sample(model) result(sample)
    type(model_t), intent(in) :: model
    type(history_sample_t) :: sample
    type(field_t) :: v(size(model%bodies%blank%parts))
    type(energy_balance_t) :: balance
    integer :: p

    do p = 1, size(v)
      v(p)%values = model%bodies%blank%parts(p)%element%motion%v
    end do
    call fill_history_sample(model, balance, instant_t(), 0_int64, v, 0.0_wp, sample)
  end function first_history_sample

  !> Which tools rotate in some step of the deck.
  pure function rotating_tools(model) result(is_turning)
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
  end function rotating_tools

  !> Value of a control-point field at a parametric point.
  pure function field_at(solid, field, xi) result(value)
    type(nurbs_solid_t), intent(in) :: solid
    real(wp), intent(in) :: field(:, :, :, :), xi(3)
    real(wp) :: value(3), total, weight
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
          weight = basis(i, 1)*basis(j, 2)*basis(k, 3) &
                  *solid%weights(first(1) + i, first(2) + j, first(3) + k)
          value = value + weight*field(first(1) + i, first(2) + j, first(3) + k, :)
          total = total + weight
        end do
      end do
    end do
    value = value/total
  end function field_at

end module history_columns
