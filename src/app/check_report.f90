!> What `igaform --check` prints of a model without running it, and of smaller models that would do
!! as well; the lowest frequencies for `igaform --modes N`; and, also for the log, which files a
!! deck reads, where the surfaces of tools come from and where tools were placed.
!!
!! A check warns of a bar whose masses make its torsion slow. A row-sum mass puts the mass of an
!! element's inside onto its faces: the second moments of a section of few elements are too large
!! (by 1 + (p + 1)/n^2 or so with n elements of degree p), and with them the polar inertia that
!! resists torsion.
module check_report
  use kinds, only: wp
  use text, only: string_t, to_text, rounded_text, place_text, append_text, counted, &
                  axis_names, upper_case
  use element, only: element_t
  use shell_joints, only: joint_words
  use blank, only: n_elements_of, mass_of, blank_t
  use model, only: model_t
  use step_control, only: step_control_t, new_step_control, next_step
  use forming_run, only: effect_lines
  use run_forecast, only: forecast_t, new_forecast, forecast_lines, outlook_t
  use scene, only: scene_t, explicit_time
  use system_files, only: true_path
  use basis_tables, only: n_lanes
  use knot_vector, only: n_spans
  use scene_reduction, only: axis_along, uniformity_problem, mirror_problem
  use failure, only: error_t
  use boundary, only: prescribed_components
  use vibration, only: fixed_t
  use body_modes, only: find_frequencies
  use static_outlook, only: static_lines
  use input_errors, only: origin_t, error_list_t, add_warning
  use symmetric_eigen, only: principal_values
  use linear_algebra, only: cross
  use patch_points, only: determinant
  implicit none
  private

  public :: print_check, print_forecast, print_lines, source_lines, saving_lines
  public :: print_modes, check_torsion, n_steps_of

  real(wp), parameter :: slender = 4.0_wp    !! length over the larger width of a bar
  real(wp), parameter :: allowed = 0.1_wp    !! of the frequency of torsion that the masses may take

  integer, parameter :: n_pieces = 4               !! of a bar, each held for itself
  real(wp), parameter :: round_off = 1.0e-6_wp     !! of its length

  !> Second moments of the mass about its centre.
  type :: moments_t
    real(wp) :: mass = 0.0_wp
    real(wp) :: centre(3) = 0.0_wp
    real(wp) :: second(6) = 0.0_wp    !! 11 22 33 12 13 23
  end type moments_t

contains

  !> Counts, mass, stable step and number of steps, to standard output.
  subroutine print_check(model)
    type(model_t), intent(in) :: model
    type(string_t), allocatable :: lines(:)
    integer :: i

    associate (blank => model%bodies%blank)
      print "(a)", "blank            "//blank%name
      do i = 1, size(blank%parts)
        if (size(blank%parts) > 1) print "(a)", "patch            "//blank%parts(i)%element%name
        allocate (lines(0))
        call blank%parts(i)%element%describe(lines)
        call print_lines(lines)
        deallocate (lines)
      end do
      if (size(blank%parts) > 1) print "(a)", "all patches      "// &
        counted(n_elements_of(blank%parts), "element")
      if (blank%seams%n_groups > 0) print "(a)", "seams            "// &
        counted(size(blank%seams%point), "control point")//" at "// &
        counted(blank%seams%n_groups, "location")
      if (joint_words(blank%joints) /= "") print "(a)", "joints           "// &
        joint_words(blank%joints)
      print "(a)", "mass             "//rounded_text(model%width_ratio*mass_of(blank%parts))
    end associate
    print "(a)", "tools            "//to_text(size(model%bodies%tools))
    if (allocated(model%step%name)) print "(a)", "steps of deck    "// &
      to_text(1 + size(model%later_steps))//", of the first these effects"
    call print_lines(effect_lines(model, "effect           "))
    print "(a)", "stable increment "//rounded_text(model%stable_step)
    print "(a)", "steps            about "//rounded_text(n_steps_of(model))
  end subroutine print_check

  !> The time that the run should take, to standard output.
  subroutine print_forecast(model, outlook, may_step, seconds)
    type(model_t), intent(inout) :: model   !! some steps of it are taken
    type(outlook_t), intent(in) :: outlook
    logical, intent(in) :: may_step         !! unless the law must not be called
    real(wp), intent(out) :: seconds        !! 0: no forecast
    type(forecast_t) :: forecast
    type(string_t), allocatable :: lines(:)
    real(wp) :: of_static

    seconds = 0.0_wp
    if (.not. may_step) then
      print "(a)", "run time         no forecast, for that would call the user's subroutine "// &
        "(--check --trial-run does)"
      return
    end if
    if (outlook%is_tried) print "(a)", "steps            about "// &
      rounded_text(outlook%growth*n_steps_of(model))//", as the run with fewer elements shows"
    forecast = new_forecast(model, n_steps_of(model), outlook)
    seconds = forecast%seconds
    call print_lines(forecast_lines(forecast))
    call static_lines(model, may_step, lines, of_static)
    call print_lines(lines)
    seconds = seconds + of_static
    if (.not. outlook%is_tried .and. any([model%step%has_relaxation, &
                                          model%later_steps%step%has_relaxation])) &
      print "(a)", "                 less where a relaxation ends before its time limit "// &
        "(--check --trial-run estimates when)"
  end subroutine print_forecast

  !> Increments of the explicit steps if all are as long as the first.
  real(wp) function n_steps_of(model)
    type(model_t), intent(in) :: model
    type(step_control_t) :: control

    control = new_step_control(model)
    n_steps_of = explicit_time(model%step, model%later_steps) &
                 /next_step(control, 0.0_wp, model%rate)
  end function n_steps_of

  !> Print lines to standard output.
  subroutine print_lines(lines)
    type(string_t), intent(in) :: lines(:)
    integer :: i

    do i = 1, size(lines)
      print "(a)", lines(i)%value
    end do
  end subroutine print_lines

  !> One line for each file that the deck includes with its path resolved, for each note on a tool,
  !! the tool's name before the first, for each file of an outline or a trim, and for each tool that
  !! *TOOL PLACEMENT has moved.
  function source_lines(scene, model) result(lines)
    type(scene_t), intent(in) :: scene
    type(model_t), intent(in) :: model
    type(string_t), allocatable :: lines(:)
    integer :: t, i

    allocate (lines(0))
    do i = 2, size(scene%files)
      call append_text(lines, "reads      "//true_path(scene%files(i)%value))
    end do
    do t = 1, size(scene%tools)
      if (.not. allocated(scene%tools(t)%notes)) cycle
      do i = 1, size(scene%tools(t)%notes)
        if (i == 1) then
          call append_text(lines, "tool "//scene%tools(t)%name//" from "// &
                                  scene%tools(t)%notes(1)%value)
        else
          call append_text(lines, "  "//scene%tools(t)%notes(i)%value)
        end if
      end do
    end do
    if (allocated(scene%outlines)) then
      do t = 1, size(scene%outlines)
        do i = 1, size(scene%outlines(t)%notes)
          call append_text(lines, trim(merge("outline", "trim   ", scene%outlines(t)%step == 0))// &
                           " "//scene%outlines(t)%name//" from "//scene%outlines(t)%notes(i)%value)
        end do
      end do
    end if
    do t = 1, size(scene%tools)
      if (.not. any(abs(scene%tools(t)%placing) > 0.0_wp)) cycle
      call append_text(lines, placing_line(scene, model, t))
    end do
  end function source_lines

  !> How far *TOOL PLACEMENT has moved a tool.
  function placing_line(scene, model, t) result(line)
    type(scene_t), intent(in) :: scene
    type(model_t), intent(in) :: model
    integer, intent(in) :: t
    character(:), allocatable :: line
    real(wp) :: shift(3)

    shift = model%bodies%tools(t)%surfaces(1)%points(1, 1, :) - &
            scene%tools(t)%surfaces(1)%points(1, 1, :)
    line = "tool "//scene%tools(t)%name//" placed: moved by "//place_text(shift)//", clearance "// &
           rounded_text(scene%tools(t)%clearance)
  end function placing_line

  !> The strip and the symmetry planes that a scene qualifies for, with the fraction of the cost
  !! that each would save: elements are worked eight at a time along their first axis.
  function saving_lines(scene) result(lines)
    type(scene_t), intent(in) :: scene
    type(string_t), allocatable :: lines(:)
    integer :: c, axis, n(3), reduced(3)

    allocate (lines(0))
    if (size(scene%blank%patches) > 1) return
    if (scene%reduction%component >= 0) then
      call append_text(lines, "reduction        plane strain, results for the full width")
      return
    end if
    n = elements(scene)
    do c = 1, 3
      axis = axis_along(scene, c)
      if (axis == 0) cycle
      reduced = n
      reduced(axis) = 1
      if (.not. cost(reduced) < cost(n)) cycle
      if (uniformity_problem(scene, c) == "") call append_text(lines, "could be         "// &
        "a strip (*REDUCE, TYPE=PLANE STRAIN, AXIS="//axis_names(c)//"), uniform along "// &
        axis_names(c)//": 1 of "//to_text(n(axis))//" elements, saves "// &
        percent(1.0_wp - cost(reduced)/cost(n))//"; exact where the edges are constrained; "// &
        "with free edges for bending, not for stretching, in which a sheet narrows")
    end do
    do c = 1, 3
      if (mirror_problem(scene, c) /= "") cycle
      do axis = 1, 2
        if (.not. varies_along(scene, axis, c)) cycle
        reduced = n
        reduced(axis) = (n(axis) + 1)/2
        if (.not. cost(reduced) < cost(n)) cycle
        call append_text(lines, "could be         one half (cut the blank, *BOUNDARY "// &
                 upper_case(axis_names(c))//"SYMM on the cut), symmetric in "// &
                 axis_names(c)//": saves "//percent(1.0_wp - cost(reduced)/cost(n)))
      end do
    end do
  end function saving_lines

  pure function elements(scene) result(n)
    type(scene_t), intent(in) :: scene
    integer :: n(3), axis

    do axis = 1, 3
      n(axis) = n_spans(scene%blank%patches(1)%solid%axes(axis))
    end do
  end function elements

  !> Is this the axis of the blank that runs across the plane?
  pure logical function varies_along(scene, axis, component)
    type(scene_t), intent(in) :: scene
    integer, intent(in) :: axis, component
    real(wp) :: ends(3)

    associate (points => scene%blank%patches(1)%solid%points)
      if (axis == 1) then
        ends = abs(points(size(points, 1), 1, 1, :) - points(1, 1, 1, :))
      else
        ends = abs(points(1, size(points, 2), 1, :) - points(1, 1, 1, :))
      end if
    end associate
    varies_along = ends(component) >= maxval(ends)
  end function varies_along

  pure real(wp) function cost(n)
    integer, intent(in) :: n(3)

    cost = real(n_lanes*((n(1) + n_lanes - 1)/n_lanes)*n(2)*n(3), wp)
  end function cost

  pure function percent(fraction) result(text)
    real(wp), intent(in) :: fraction
    character(:), allocatable :: text

    text = to_text(nint(100.0_wp*fraction))//" % of the elements' cost"
  end function percent

  !> The lowest frequencies and periods of the blank in its shape at the start, without stress and
  !! contact, to standard output. Components with a prescribed velocity are fixed. Where it fails,
  !! nothing is printed.
  subroutine print_modes(model, n_modes, error)
    type(model_t), intent(in) :: model
    integer, intent(in) :: n_modes
    type(error_t), allocatable, intent(out) :: error
    real(wp), parameter :: two_pi = 2.0_wp*acos(-1.0_wp)
    type(fixed_t), allocatable :: fixed(:)
    real(wp), allocatable :: frequency(:)
    character(16) :: period
    integer :: i

    associate (blank => model%bodies%blank)
      fixed = prescribed_components(blank%parts, model%supports, model%i_step)
      call find_frequencies(blank%parts, blank%seams, blank%law, fixed, blank%joints, n_modes, &
                            frequency, error)
    end associate
    if (allocated(error)) return
    frequency = frequency/two_pi
    print "(a)", "mode         frequency            period"
    do i = 1, min(n_modes, size(frequency))
      period = repeat(" ", 15)//"-"   ! of a motion as a rigid body
      if (frequency(i) > 0.0_wp) write (period, "(es16.9)") 1.0_wp/frequency(i)
      print "(i4, 2x, es16.9, 2x, a)", i, frequency(i), period
    end do
  end subroutine print_modes

  !> Warn of a bar that can twist and whose frequencies of torsion the masses lower by more than a
  !! tenth.
  subroutine check_torsion(model, origin, errors)
    type(model_t), intent(in) :: model
    type(origin_t), intent(in) :: origin    !! of the blank
    type(error_list_t), intent(inout) :: errors
    type(moments_t) :: lumped, exact
    real(wp) :: axis(3), length, loss

    associate (blank => model%bodies%blank)
      lumped = lumped_moments(blank)
      call find_axis(lumped, axis, length)
      if (length <= 0.0_wp) return
      exact = exact_moments(blank)
      loss = 1.0_wp - sqrt(polar_moment(exact, axis)/polar_moment(lumped, axis))
      if (loss <= allowed) return
      if (is_held(blank, prescribed_components(blank%parts, model%supports, model%i_step), &
                  lumped%centre, axis, length)) return
      call add_warning(errors, origin, "a bar with few elements across, whose lumped masses "// &
                       "lie so far out that its frequencies of torsion are about "// &
                       to_text(nint(100*loss))//" % too low", "more elements across")
    end associate
  end subroutine check_torsion

  !> Of the masses of the control points.
  pure function lumped_moments(blank) result(moments)
    type(blank_t), intent(in) :: blank
    type(moments_t) :: moments
    integer :: p, i, j, k

    do p = 1, size(blank%parts)
      associate (body => blank%parts(p)%element)
        do k = 1, size(body%mass, 3)
          do j = 1, size(body%mass, 2)
            do i = 1, size(body%mass, 1)
              call add_point(body%mass(i, j, k), body%motion%x(i, j, k, :), moments)
            end do
          end do
        end do
      end associate
    end do
    call finish(moments)
  end function lumped_moments

  !> Of the volume, of unit density, by the points of the elements.
  function exact_moments(blank) result(moments)
    type(blank_t), intent(in) :: blank
    type(moments_t) :: moments
    integer :: p

    do p = 1, size(blank%parts)
      call add_part(blank%parts(p)%element, moments)
    end do
    call finish(moments)
  end function exact_moments

  !> A sum for each layer of elements, for threads; then over them in one order.
  subroutine add_part(element, moments)
    class(element_t), intent(in) :: element
    type(moments_t), intent(inout) :: moments
    type(moments_t) :: slices(element%n_elements(1))
    real(wp) :: j(3, 3), x(3), weight
    integer :: e1, e2, e3, q1, q2, q3, n

    !$omp parallel do schedule(static) private(e2, e3, q1, q2, q3, j, x, weight)
    do e1 = 1, element%n_elements(1)
      do e3 = 1, element%n_elements(3)
        do e2 = 1, element%n_elements(2)
          do q3 = 1, element%rule(3)%n
            do q2 = 1, element%rule(2)%n
              do q1 = 1, element%rule(1)%n
                call element%jacobian(element%grid, [e1, e2, e3], [q1, q2, q3], j, x)
                weight = element%rule(1)%weights(q1)*element%rule(2)%weights(q2) &
                         *element%rule(3)%weights(q3)
                call add_point(determinant(j)*weight, x, slices(e1))
              end do
            end do
          end do
        end do
      end do
    end do
    !$omp end parallel do
    do n = 1, size(slices)
      moments%mass = moments%mass + slices(n)%mass
      moments%centre = moments%centre + slices(n)%centre
      moments%second = moments%second + slices(n)%second
    end do
  end subroutine add_part

  !> Add moments about the origin.
  pure subroutine add_point(mass, x, moments)
    real(wp), intent(in) :: mass, x(3)
    type(moments_t), intent(inout) :: moments

    moments%mass = moments%mass + mass
    moments%centre = moments%centre + mass*x
    moments%second = moments%second + mass*[x**2, x(1)*x(2), x(1)*x(3), x(2)*x(3)]
  end subroutine add_point

  !> From sums about the origin to means about the centre.
  pure subroutine finish(moments)
    type(moments_t), intent(inout) :: moments

    moments%centre = moments%centre/moments%mass
    associate (x => moments%centre)
      moments%second = moments%second/moments%mass - [x**2, x(1)*x(2), x(1)*x(3), x(2)*x(3)]
    end associate
  end subroutine finish

  !> The axis of a bar and its length, as that of a box; no length where it is no bar.
  pure subroutine find_axis(moments, axis, length)
    type(moments_t), intent(in) :: moments
    real(wp), intent(out) :: axis(3), length
    real(wp) :: values(3), directions(3, 3)
    integer :: long

    call principal_values(moments%second, values, directions)
    long = maxloc(values, 1)
    axis = directions(:, long)
    values = sqrt(12.0_wp*max(values, 0.0_wp))
    length = values(long)
    if (length < slender*maxval(values, [1, 2, 3] /= long)) length = 0.0_wp
  end subroutine find_axis

  !> Second moment about an axis through the centre, over the mass.
  pure real(wp) function polar_moment(moments, axis)
    type(moments_t), intent(in) :: moments
    real(wp), intent(in) :: axis(3)

    associate (s => moments%second, a => axis)
      polar_moment = sum(s(:3)) - sum(s(:3)*a**2) - 2.0_wp*(s(4)*a(1)*a(2) + s(5)*a(1)*a(3) &
                                                            + s(6)*a(2)*a(3))
    end associate
  end function polar_moment

  !> Do boundary conditions keep the bar from twisting all along, in each quarter of its length?
  !! Those of a plane of symmetry do, clamps at its ends do not.
  pure logical function is_held(blank, fixed, centre, axis, length)
    type(blank_t), intent(in) :: blank
    type(fixed_t), intent(in) :: fixed(:)      !! prescribed components, by patch
    real(wp), intent(in) :: centre(3), axis(3), length
    logical :: is_piece_held(n_pieces)
    integer :: p, i, j, k

    is_piece_held = .false.
    do p = 1, size(blank%parts)
      associate (x => blank%parts(p)%element%motion%x)
        do k = 1, size(x, 3)
          do j = 1, size(x, 2)
            do i = 1, size(x, 1)
              if (.not. is_stopped(fixed(p), x, [i, j, k], centre, axis, round_off*length)) cycle
              is_piece_held(piece_of(x(i, j, k, :), centre, axis, length)) = .true.
            end do
          end do
        end do
      end associate
    end do
    is_held = all(is_piece_held)
  end function is_held

  !> Is a control point kept from turning about an axis, or tied to one that turns another way?
  pure logical function is_stopped(fixed, x, at, centre, axis, least)
    type(fixed_t), intent(in) :: fixed
    real(wp), intent(in) :: x(:, :, :, :)      !! control points [length]
    integer, intent(in) :: at(3)
    real(wp), intent(in) :: centre(3), axis(3), least   !! least: way that counts [length]
    real(wp) :: way(3)
    integer :: c, n(3), place, leader

    way = cross(axis, x(at(1), at(2), at(3), :) - centre)
    is_stopped = any(fixed%is_fixed(at(1), at(2), at(3), :) .and. abs(way) > least)
    if (is_stopped .or. .not. allocated(fixed%leader)) return
    n = shape(x(:, :, :, 1))
    place = at(1) - 1 + n(1)*(at(2) - 1 + n(2)*(at(3) - 1))
    do c = 1, 3
      leader = mod(fixed%leader(1 + place + product(n)*(c - 1)) - 1, product(n))
      way = cross(axis, x(at(1), at(2), at(3), :) &
                  - x(1 + mod(leader, n(1)), 1 + mod(leader/n(1), n(2)), &
                      1 + leader/(n(1)*n(2)), :))
      is_stopped = is_stopped .or. abs(way(c)) > least
    end do
  end function is_stopped

  !> In which quarter of the length of a bar a point lies.
  pure integer function piece_of(x, centre, axis, length) result(piece)
    real(wp), intent(in) :: x(3), centre(3), axis(3), length

    piece = max(1, min(n_pieces, 1 + floor(n_pieces*(0.5_wp + dot_product(axis, x - centre) &
                                                     /length))))
  end function piece_of

end module check_report
