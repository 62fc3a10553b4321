!> Mass scaling, the stable time increment that goes with it, and penalties within what it leaves;
!! damping and relaxation.
module stability_setup
  use kinds, only: wp
  use thickness_masses, only: difference_masses
  use patch_seams, only: column_mask_t
  use stable_step, only: largest_frequency, viscous_step, stable_element_step
  use body_parts, only: set_inertia
  use shell_joints, only: set_stiffness, largest_bound
  use blank, only: blank_t, mass_of, columns_of
  use boundary, only: prescribed_components
  use vibration, only: fixed_t
  use damping, only: damping_t, start_damping, relaxation_t
  use thickness_scaling, only: thickness_scaling_t, held_column_t
  use effect, only: effect_slot_t, add_effect
  use scene, only: step_spec_t, contact_spec_t
  use model, only: model_t, increment_limit, add_support
  use input_errors, only: origin_t, error_list_t, add_warning
  use text, only: to_text, rounded_text, counted
  use contact, only: scale_stiffness
  use contact_effect, only: contact_view_t, contact_pairs
  implicit none
  private

  public :: set_stable_step, add_thickness_scaling, add_damping
  public :: share_penalties

  !> Shares of the square of a blank's largest frequency that its joints may have, tried one after
  !! the other until the frequency of both is larger by no more than this factor; the last one
  !! serves in any case.
  real(wp), parameter :: joint_shares(4) = [0.8_wp, 0.6_wp, 0.35_wp, 0.15_wp]
  real(wp), parameter :: joint_cost = 1.03_wp

contains

  !> Scale the masses as the deck asks and find the stable step of what comes out.
  subroutine set_stable_step(model)
    type(model_t), intent(inout) :: model
    real(wp) :: omega, dt, rate, factor
    integer :: p

    associate (blank => model%bodies%blank, step => model%step)
      if (step%thickness_factor > 1.0_wp) call scale_columns(model)
      if (step%is_element_step) then
        model%stable_step = huge(1.0_wp)
        model%rate = 0.0_wp
        do p = 1, size(blank%parts)
          call stable_element_step(blank%parts(p)%element, blank%law, dt, rate)
          model%stable_step = min(model%stable_step, dt)
          model%rate = max(model%rate, rate)
        end do
        ! The squares of frequencies that bound two stiffnesses add up to a bound of both.
        if (blank%joints%n_cells > 0) then
          call set_stiffness(blank%joints, blank%parts, blank%seams, blank%law, &
                             joint_shares(size(joint_shares))*(2.0_wp/model%stable_step)**2)
          model%stable_step = 2.0_wp/sqrt((2.0_wp/model%stable_step)**2 &
                                          + largest_bound(blank%joints, blank%parts, blank%seams))
        end if
      else
        call find_frequency(blank, omega, model%rate)
        model%stable_step = viscous_step(blank%parts, blank%seams, blank%law, omega)
      end if
      if (step%target_step > increment_limit(model)) then
        factor = (step%target_step/increment_limit(model))**2   ! on all masses
        blank%added_mass = factor*(blank%added_mass + mass_of(blank%parts)) - mass_of(blank%parts)
        blank%mass_factor = factor
        do p = 1, size(blank%parts)
          call blank%parts(p)%element%scale_mass(factor)
        end do
        call set_inertia(blank%parts, blank%seams)
        model%stable_step = step%target_step/step%safety
      end if
    end associate
  end subroutine set_stable_step

  !> Largest angular frequency, after joints have been made as stiff as it lets them.
  subroutine find_frequency(blank, omega, rate)
    type(blank_t), intent(inout) :: blank
    real(wp), intent(out) :: omega, rate     !! as of `largest_frequency`
    real(wp), parameter :: notch = 1.02_wp
    real(wp) :: alone, square, unit
    integer :: i

    call largest_frequency(blank%parts, blank%seams, blank%law, omega, rate)
    if (blank%joints%n_cells == 0 .or. .not. omega <= huge(omega)) return
    alone = omega
    ! Rounded, in a unit of the blank: the error of the estimate must not show in the joints.
    unit = blank%parts(1)%element%shortest
    do i = 2, size(blank%parts)
      unit = min(unit, blank%parts(i)%element%shortest)
    end do
    unit = sqrt(blank%law%bulk/blank%law%density)/unit
    square = unit**2*notch**floor(2.0_wp*log(alone/unit)/log(notch))
    do i = 1, size(joint_shares)
      call set_stiffness(blank%joints, blank%parts, blank%seams, blank%law, &
                         joint_shares(i)*square)
      call largest_frequency(blank%parts, blank%seams, blank%law, omega, rate, blank%joints)
      if (omega <= joint_cost*alone) return
    end do
  end subroutine find_frequency

  !> Factors of the columns; those that seams mix up stay as they are. Supports play no part: what
  !! they hold only lowers frequencies, so the stable step is that of every step of the deck.
  subroutine scale_columns(model)
    type(model_t), intent(inout) :: model
    type(column_mask_t), allocatable :: is_whole(:)
    integer :: p

    associate (blank => model%bodies%blank)
      is_whole = columns_of(blank)
      do p = 1, size(blank%parts)
        associate (body => blank%parts(p)%element)
          body%column_factor = merge(model%step%thickness_factor, 1.0_wp, is_whole(p)%values)
          blank%added_mass = blank%added_mass + sum((body%column_factor - 1.0_wp) &
            *difference_masses(body%inertia)*sum(body%mass, 3)/sum(body%inertia, 3))/3.0_wp
        end associate
      end do
    end associate
  end subroutine scale_columns

  !> Put the scaling of columns behind all forces: one effect for each run of steps whose supports
  !! hold the same columns in part. The supports must be there already.
  subroutine add_thickness_scaling(model)
    type(model_t), intent(inout) :: model
    type(thickness_scaling_t) :: scaling
    type(held_column_t), allocatable :: held(:)
    integer :: s, n, n_steps

    if (.not. allocated(model%bodies%blank%parts(1)%element%column_factor)) return
    scaling%name = "thickness scaling"
    n_steps = 1 + size(model%later_steps)
    call find_held_columns(model, 1, scaling%held)
    do s = 1, n_steps
      if (s < n_steps) then
        call find_held_columns(model, s + 1, held)
        if (are_same_columns(scaling%held, held)) cycle
      end if
      scaling%last_step = s
      scaling%before = spread(0.0_wp, 1, sum([(size(scaling%held(n)%is_held), &
                                               n=1, size(scaling%held))]))
      call add_effect(model%forces, scaling)
      if (s == n_steps) exit
      scaling%first_step = s + 1
      scaling%given_step = s + 1
      call move_alloc(held, scaling%held)
    end do
  end subroutine add_thickness_scaling

  !> Scaled columns of which supports of a step hold some points and not the others.
  subroutine find_held_columns(model, step, held)
    type(model_t), intent(in) :: model
    integer, intent(in) :: step              !! of the deck
    type(held_column_t), allocatable, intent(out) :: held(:)
    type(fixed_t), allocatable :: fixed(:)
    logical, allocatable :: is_mixed(:, :)
    integer :: p, i, j, c, n, pass

    fixed = prescribed_components(model%bodies%blank%parts, &
                                  [model%supports, model%later_supports], step)
    do pass = 1, 2
      n = 0
      do p = 1, size(fixed)
        associate (is_fixed => fixed(p)%is_fixed, &
                   factor => model%bodies%blank%parts(p)%element%column_factor)
          is_mixed = factor < 0.0_wp
          do c = 1, 3
            is_mixed = is_mixed .or. (any(is_fixed(:, :, :, c), 3) .and. &
                                      .not. all(is_fixed(:, :, :, c), 3))
          end do
          is_mixed = is_mixed .and. factor > 1.0_wp
          do j = 1, size(factor, 2)
            do i = 1, size(factor, 1)
              if (.not. is_mixed(i, j)) cycle
              n = n + 1
              if (pass == 1) cycle
              held(n)%part = p
              held(n)%at = [i, j]
              held(n)%is_held = is_fixed(i, j, :, :)
            end do
          end do
        end associate
      end do
      if (pass == 1) allocate (held(n))
    end do
  end subroutine find_held_columns

  pure logical function are_same_columns(a, b) result(are_same)
    type(held_column_t), intent(in) :: a(:), b(:)
    integer :: n

    are_same = size(a) == size(b)
    do n = 1, size(a)
      if (.not. are_same) return
      are_same = a(n)%part == b(n)%part .and. all(a(n)%at == b(n)%at)
      if (are_same) are_same = all(a(n)%is_held .eqv. b(n)%is_held)
    end do
  end function are_same_columns

  !> Add damping and relaxation. A damping that several steps share is one.
  subroutine add_damping(settled_from, settled_total, model)
    real(wp), intent(in) :: settled_from(:)  !! time of each step from which curves are constant
    real(wp), intent(in) :: settled_total(size(settled_from))   !! the same as time of the run
    type(model_t), intent(inout) :: model
    type(step_spec_t) :: step, next
    class(damping_t), allocatable :: damping
    type(relaxation_t) :: relaxation
    integer :: s, last

    last = 0
    do s = 1, size(settled_from)
      if (s <= last) cycle
      last = s
      step = spec_of(model, s)
      if (step%has_relaxation) then
        relaxation%name = "dynamic relaxation"
        relaxation%is_kinetic = step%is_kinetic
        relaxation%energy_limit = step%energy_residual
        relaxation%force_limit = step%force_residual
        relaxation%settled_from = settled_from(s)
        relaxation%settled_total = settled_total(s)
        relaxation%fixed = prescribed_components(model%bodies%blank%parts, &
                                                 [model%supports, model%later_supports], s)
        allocate (damping, source=relaxation)
      else if (step%alpha > 0.0_wp) then
        do last = s, size(settled_from) - 1
          next = spec_of(model, last + 1)
          if (next%has_relaxation .or. abs(step%alpha - next%alpha) > 0.0_wp) exit
        end do
        allocate (damping_t :: damping)
        damping%name = "damping"
        damping%alpha = step%alpha
      else
        cycle
      end if
      call start_damping(damping, model%bodies%blank)
      damping%first_step = s
      damping%given_step = s
      damping%last_step = last
      call add_support(model, damping)
      deallocate (damping)
    end do
  end subroutine add_damping

  !> A step of the deck, before any has begun.
  pure function spec_of(model, step) result(spec)
    type(model_t), intent(in) :: model
    integer, intent(in) :: step
    type(step_spec_t) :: spec

    if (step == 1) spec = model%step
    if (step > 1) spec = model%later_steps(step - 1)%step
  end function spec_of

  !> Let the penalties of all tools on the same control points (those of a face of a solid, of both
  !! faces of a shell) together stay within what the step leaves: a penalty
  !! s m/dt^2 beside the blank's own frequency w is stable for (w dt)^2 + s <= 4, and w dt is twice
  !! the safety factor. A single tool is left as the deck wants it, with a warning. The greatest
  !! sum of a face is kept in the model.
  subroutine share_penalties(origin, model, errors)
    type(origin_t), intent(in) :: origin   !! of the pairs, for a warning
    type(model_t), intent(inout), target :: model
    type(error_list_t), intent(inout) :: errors
    type(contact_view_t), allocatable :: pairs(:)
    integer :: i

    pairs = contact_pairs(model%forces)
    do i = 1, size(pairs)
      call share_face(origin, pairs, i, model, errors)
    end do
  end subroutine share_penalties

  !> Share the penalty of all pairs on the same control points, if `first` is the first of them.
  subroutine share_face(origin, pairs, first, model, errors)
    type(origin_t), intent(in) :: origin
    type(contact_view_t), intent(in) :: pairs(:)    !! of the model
    integer, intent(in) :: first
    type(model_t), intent(inout), target :: model   ! which holds the pairs
    type(error_list_t), intent(inout) :: errors
    real(wp) :: shares(size(pairs)), limit, left, total
    type(contact_spec_t) :: usual
    logical :: is_there(size(pairs)), is_elsewhere
    integer :: i, step, n_tools

    shares = 0.0_wp
    is_elsewhere = .false.
    do i = 1, size(pairs)
      associate (pair => pairs(i)%pair, face => pairs(first)%pair)
        if (pair%part /= face%part) cycle
        if (any(pair%lower /= face%lower .or. pair%upper /= face%upper)) cycle
        if (i < first) return
        shares(i) = pair%pair%scale
        is_elsewhere = is_elsewhere .or. pair%face /= face%face
      end associate
    end do
    left = max(0.0_wp, 4*(1 - model%step%safety**2))
    ! Increments beyond the stable one have been reported, whatever the penalty.
    if (maxval(shares) > left .and. left > 0.0_wp) call add_warning(errors, origin, &
      "a penalty of "//rounded_text(maxval(shares))//" times mass over the square of the step", &
      "at most "//rounded_text(left)//", all that the safety factor "// &
      to_text(model%step%safety)//" leaves: beyond it contact may be unstable")
    limit = max(left, maxval(shares))
    total = 0.0_wp
    do step = 1, 1 + size(model%later_steps)
      is_there = [(pairs(i)%pair%first_step <= step .and. &
                   pairs(i)%pair%last_step >= step, i=1, size(pairs))]
      if (sum(shares, mask=is_there) <= total) cycle
      total = sum(shares, mask=is_there)
      n_tools = count(shares > 0.0_wp .and. is_there)
    end do
    model%penalty = max(model%penalty, min(total, limit))
    if (total <= limit) return
    do i = 1, size(pairs)
      if (shares(i) > 0.0_wp) call scale_stiffness(pairs(i)%pair%pair, limit/total)
    end do
    ! Of a shell with many tools nobody has chosen it.
    if (is_elsewhere .and. maxval(shares) <= usual%penalty_scale) return
    if (left > 0.0_wp) call add_warning(errors, origin, "penalties of "//counted(n_tools, &
                     "tool")//" on "//trim(merge("both faces", "one face  ", is_elsewhere))// &
                     " that add up to "//rounded_text(total), &
                     "at most "//rounded_text(limit)//" with the scale factor "// &
                     rounded_text(model%step%safety)//"; they are scaled to that")
  end subroutine share_face

end module stability_setup