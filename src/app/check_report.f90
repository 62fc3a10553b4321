!> What `igaform --check` prints of a model without running it, and of smaller scenes that would do
!! as well; and, also for the log, which files a deck reads, where the surfaces of tools come from
!! and where tools were placed.
module check_report
  use kinds, only: wp
  use text, only: string_t, to_text, rounded_text, place_text, append_text
  use element, only: element_t
  use blank, only: n_elements_of, mass_of
  use model, only: model_t
  use step_control, only: step_control_t, new_step_control, next_step
  use step_report, only: effect_names
  use run_forecast, only: new_forecast, forecast_lines, outlook_t
  use scene, only: scene_t
  use system_files, only: true_path
  use basis_tables, only: n_lanes
  use knot_vector, only: n_spans
  use scene_symmetry, only: axis_along, uniformity_problem, mirror_problem
  implicit none
  private

  public :: print_check, print_forecast, source_lines, saving_lines

contains

  !> Counts, mass, stable step and number of steps, to standard output.
  subroutine print_check(model)
    type(model_t), intent(in) :: model
    type(string_t), allocatable :: effects(:)
    integer :: i

    associate (blank => model%bodies%blank)
      print "(a)", "blank            "//blank%name
      do i = 1, size(blank%parts)
        if (size(blank%parts) > 1) print "(a)", "patch            "//blank%parts(i)%element%name
        call print_lines(blank%parts(i)%element)
      end do
      if (size(blank%parts) > 1) print "(a)", "all patches      "// &
        to_text(n_elements_of(blank%parts))//" elements"
      if (blank%seams%n_groups > 0) print "(a)", "seams            "// &
        to_text(size(blank%seams%point))//" control points at "// &
        to_text(blank%seams%n_groups)//" places"
      print "(a)", "mass             "//rounded_text(model%width_ratio*mass_of(blank%parts))
    end associate
    print "(a)", "tools            "//to_text(size(model%bodies%tools))
    if (allocated(model%step%name)) print "(a)", "steps of deck    "// &
      to_text(1 + size(model%later_steps))//", of the first these effects"
    effects = effect_names(model)
    do i = 1, size(effects)
      print "(a)", "effect           "//effects(i)%value
    end do
    print "(a)", "stable increment "//rounded_text(model%stable_step)
    print "(a)", "steps            about "//rounded_text(n_steps_of(model))
  end subroutine print_check

  !> The time that the run should take, to standard output.
  subroutine print_forecast(model, outlook, may_step)
    type(model_t), intent(inout) :: model   !! some steps of it are taken
    type(outlook_t), intent(in) :: outlook
    logical, intent(in) :: may_step         !! unless the law must not be called
    type(string_t), allocatable :: lines(:)
    integer :: i

    if (.not. may_step) then
      print "(a)", "run time         no forecast, for that would call the user's subroutine "// &
        "(--check --trial-run does)"
      return
    end if
    if (outlook%is_tried) print "(a)", "steps            about "// &
      rounded_text(outlook%growth*n_steps_of(model))//", as the run with fewer elements shows"
    ! Not in a PRINT: a user's law may write as well.
    lines = forecast_lines(new_forecast(model, n_steps_of(model), outlook))
    do i = 1, size(lines)
      print "(a)", lines(i)%value
    end do
    if (.not. outlook%is_tried .and. any([model%step%has_relaxation, &
                                          model%later_steps%step%has_relaxation])) &
      print "(a)", "                 less where a relaxation ends before its time limit "// &
        "(--check --trial-run estimates when)"
  end subroutine print_forecast

  !> Steps of a run if all are as long as the first.
  real(wp) function n_steps_of(model)
    type(model_t), intent(in) :: model
    type(step_control_t) :: control

    control = new_step_control(model)
    n_steps_of = (model%step%duration + sum(model%later_steps%step%duration)) &
                 /next_step(control, 0.0_wp, model%rate)
  end function n_steps_of

  subroutine print_lines(element)
    class(element_t), intent(in) :: element
    type(string_t), allocatable :: lines(:)
    integer :: i

    allocate (lines(0))
    call element%describe(lines)
    do i = 1, size(lines)
      print "(a)", lines(i)%value
    end do
  end subroutine print_lines

  !> One line for each file beside the deck with its path resolved, for each note on a tool, the
  !! tool's name before the first, and for each tool that *TOOL PLACEMENT has moved.
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
    do t = 1, size(scene%tools)
      if (.not. any(abs(scene%tools(t)%placing) > 0.0_wp)) cycle
      call append_text(lines, placing_line(scene, model, t))
    end do
  end function source_lines

  !> How far a tool was moved to its place.
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

  !> The strip and the symmetry planes that a scene qualifies for, with the share of the cost that
  !! each would save: elements are worked eight at a time along their first axis.
  function saving_lines(scene) result(lines)
    type(scene_t), intent(in) :: scene
    type(string_t), allocatable :: lines(:)
    character(3), parameter :: letters = "xyz"
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
        "a strip (*REDUCE, TYPE=PLANE STRAIN, AXIS="//letters(c:c)//"), uniform along "// &
        letters(c:c)//": 1 of "//to_text(n(axis))//" elements, saves "// &
        percent(1.0_wp - cost(reduced)/cost(n))//"; exact where the edges are held; with "// &
        "free edges for bending, not for pulling, in which a sheet narrows")
    end do
    do c = 1, 3
      if (mirror_problem(scene, c) /= "") cycle
      do axis = 1, 2
        if (.not. varies_along(scene, axis, c)) cycle
        reduced = n
        reduced(axis) = (n(axis) + 1)/2
        if (.not. cost(reduced) < cost(n)) cycle
        call append_text(lines, "could be         one half (cut the blank, *BOUNDARY "//upper(c)// &
                 "SYMM on the cut), symmetric in "//letters(c:c)//": saves "// &
                 percent(1.0_wp - cost(reduced)/cost(n)))
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

  pure character(1) function upper(component)
    integer, intent(in) :: component
    character(3), parameter :: letters = "XYZ"

    upper = letters(component:component)
  end function upper

  pure function percent(share) result(text)
    real(wp), intent(in) :: share
    character(:), allocatable :: text

    text = to_text(nint(100.0_wp*share))//" % of the elements' cost"
  end function percent

end module check_report
