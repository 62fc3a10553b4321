!> Writes a results file whose contents are known: a sheet that bows to a parabola, a flat tool that
!! moves and a quarter cylinder. Arguments: the file's name, then LAGRANGE or BEZIER, then, if a
!! writer that never ends is wanted, the word FOREVER.
program write_example
  use, intrinsic :: iso_fortran_env, only: int64
  use kinds, only: wp
  use failure, only: error_t
  use timer, only: add_watch, start_watch, stop_watch
  use gauss_rule, only: new_gauss_rule
  use knot_vector, only: greville, knot_vector_t, new_knot_vector
  use nurbs_surface, only: nurbs_surface_t
  use history, only: history_sample_t, begin_sample, enter, record_sample
  use run_log, only: timings_t
  use display_fields, only: output_fields
  use frames, only: close_results, frame_t, open_results, results_setup_t, &
                    results_t, write_frame
  implicit none

  integer, parameter :: n_elements(3) = [5, 2, 1], n_frames = 4
  real(wp), parameter :: size_of_sheet(3) = [100.0_wp, 20.0_wp, 2.0_wp], radius = 30.0_wp
  type(results_t) :: results
  type(results_setup_t) :: setup
  type(error_t), allocatable :: error
  character(256) :: path, cells, ending
  integer :: i

  call get_command_argument(1, path)
  call get_command_argument(2, cells)
  call get_command_argument(3, ending)
  call describe(setup, trim(path), cells == "BEZIER")
  call open_results(results, setup, error)
  call check(error)
  i = 0
  do while (i < n_frames .or. ending == "FOREVER")
    call one_frame(results, setup, real(i, wp))
    i = i + 1
    if (ending == "FOREVER") print "(i0)", i
  end do
  call finish(results)

contains

  subroutine describe(setup, path, is_bezier)
    type(results_setup_t), intent(out) :: setup
    character(*), intent(in) :: path
    logical, intent(in) :: is_bezier
    integer :: d, n(3)

    allocate (setup%patches(1))
    setup%patches(1)%name = "sheet"
    setup%path = path
    setup%is_bezier = is_bezier
    setup%n_state = 1
    setup%fields = output_fields(0, has_stress=.true.)
    setup%provenance%version = "0.1.0"
    setup%provenance%units = "mm, t, s"
    setup%provenance%deck_text = "*HEADING"//new_line("a")//"a sheet that bows, µ"
    do d = 1, 3
      setup%patches(1)%solid%axes(d) = uniform_axis(2, n_elements(d), size_of_sheet(d))
      setup%patches(1)%rule(d) = new_gauss_rule(merge(3, 2, d == 3), merge(2, 1, d == 3))
    end do
    n = n_elements + 2
    allocate (setup%patches(1)%solid%points(n(1), n(2), n(3), 3))
    allocate (setup%patches(1)%solid%weights(n(1), n(2), n(3)))
    setup%patches(1)%solid%weights = 1.0_wp
    setup%patches(1)%solid%points = bowed(setup, 0.0_wp)
    allocate (setup%tools(2))
    setup%tools(1)%name = "plate"
    allocate (setup%tools(1)%surfaces(1), setup%tools(2)%surfaces(1))
    setup%tools(1)%surfaces(1) = plate()
    setup%tools(2)%name = "cylinder"
    setup%tools(2)%surfaces(1) = quarter_cylinder()
    setup%history = row_at(0.0_wp)
  end subroutine describe

  ! y = curvature*x^2 added to the flat sheet, which quadratic splines hold exactly.
  function bowed(setup, curvature) result(points)
    type(results_setup_t), intent(in) :: setup
    real(wp), intent(in) :: curvature
    real(wp), allocatable :: points(:, :, :, :)
    real(wp), allocatable :: x(:), y(:), z(:)
    integer :: i, j, k

    x = greville(setup%patches(1)%solid%axes(1))
    y = greville(setup%patches(1)%solid%axes(2))
    z = greville(setup%patches(1)%solid%axes(3))
    allocate (points(size(x), size(y), size(z), 3))
    do k = 1, size(z)
      do j = 1, size(y)
        do i = 1, size(x)
          associate (knots => setup%patches(1)%solid%axes(1)%knots)
            points(i, j, k, :) = [x(i), z(k) + curvature*knots(i + 1)*knots(i + 2), -y(j)]
          end associate
        end do
      end do
    end do
  end function bowed

  subroutine one_frame(results, setup, time)
    type(results_t), intent(inout) :: results
    type(results_setup_t), intent(in) :: setup
    real(wp), intent(in) :: time
    type(frame_t) :: frame
    type(error_t), allocatable :: error
    integer :: e

    frame%time = time
    allocate (frame%patches(1))
    frame%patches(1)%points = bowed(setup, 1.0e-3_wp*time)
    frame%patches(1)%velocity = bowed(setup, 1.0e-3_wp) - bowed(setup, 0.0_wp)
    allocate (frame%patches(1)%eqps(2, 2, 6, 5, 2, 1), frame%patches(1)%stress(6, 2, 2, 6, 5, 2, 1))
    frame%patches(1)%stress = 0.0_wp
    do e = 1, 5
      frame%patches(1)%eqps(:, :, :, e, :, :) = 0.01_wp*time*e
    end do
    frame%patches(1)%stress(1, :, :, :, :, :, :) = 100*time
    frame%patches(1)%state = reshape(frame%patches(1)%eqps, [1, shape(frame%patches(1)%eqps)])
    frame%tool_displacement = reshape([0.0_wp, -2*time, 0.0_wp, 0.0_wp, 0.0_wp, 0.0_wp], [3, 2])
    frame%tool_velocity = reshape([0.0_wp, -2.0_wp, 0.0_wp, 0.0_wp, 0.0_wp, 0.0_wp], [3, 2])
    call record_sample(results%history, row_at(time))
    call record_sample(results%history, row_at(time + 0.5_wp))
    call write_frame(results, frame, error)
    call check(error)
  end subroutine one_frame

  function row_at(time) result(row)
    real(wp), intent(in) :: time
    type(history_sample_t) :: row

    call begin_sample(row)
    call enter(row, "/history/step", nint(10*time, int64), "number of steps done")
    call enter(row, "/history/process_step", 1_int64, "step of the deck, from 1 on")
    call enter(row, "/history/time", time, "time", "time")
    call enter(row, "/history/dt", 0.1_wp, "time", "length of the last step")
    call enter(row, "/history/external_work", 3*time, "energy", "work of the tools")
    call enter(row, "/history/kinetic_energy", 0.0_wp, "energy", "zero here")
    call enter(row, "/history/internal_energy", 0.0_wp, "energy", "zero here")
    call enter(row, "/history/plastic_work", 0.0_wp, "energy", "zero here")
    call enter(row, "/history/contact_energy", 0.0_wp, "energy", "zero here")
    call enter(row, "/history/friction_energy", 0.0_wp, "energy", "zero here")
    call enter(row, "/history/viscous_energy", 0.0_wp, "energy", "zero here")
    call enter(row, "/history/damping_energy", 0.0_wp, "energy", "zero here")
    call enter(row, "/history/energy_error", 0.0_wp, "1", "zero here")
    call enter(row, "/history/max_penetration", 0.0_wp, "length", "zero here")
    call enter(row, "/tools/plate/displacement", [0.0_wp, -2*time, 0.0_wp], "length", "of the tool")
    call enter(row, "/tools/plate/force", [0.0_wp, 7*time, 0.0_wp], "force", "on the tool")
    call enter(row, "/tools/cylinder/displacement", [0.0_wp, 0.0_wp, 0.0_wp], "length", &
               "of the tool")
    call enter(row, "/tools/cylinder/force", [0.0_wp, 0.0_wp, 0.0_wp], "force", "on the tool")
    call enter(row, "/history/probes/middle/displacement", [1.0_wp, 2.0_wp, 3.0_wp]*time, &
               "length", "of the point")
    call enter(row, "/history/probes/middle/velocity", [1.0_wp, 2.0_wp, 3.0_wp], "velocity", &
               "of the point")
  end function row_at

  subroutine finish(results)
    type(results_t), intent(inout) :: results
    type(timings_t) :: timings
    type(error_t), allocatable :: error
    integer :: watch

    call add_watch(timings%timer, "blank forces", watch)
    call start_watch(timings%timer, watch)
    call stop_watch(timings%timer, watch)
    timings%n_elements = product(n_elements)
    timings%n_steps = 30
    timings%wall_seconds = 3.0e-6_wp
    call close_results(results, "completed", timings, error)
    call check(error)
  end subroutine finish

  function plate() result(surface)
    type(nurbs_surface_t) :: surface

    surface%axes(1) = uniform_axis(2, 2, 100.0_wp)
    surface%axes(2) = uniform_axis(1, 1, 20.0_wp)
    allocate (surface%points(4, 2, 3), surface%weights(4, 2))
    surface%weights = 1.0_wp
    surface%points(:, :, 1) = spread(greville(surface%axes(1)), 2, 2)
    surface%points(:, :, 2) = 20.0_wp
    surface%points(:, :, 3) = -spread(greville(surface%axes(2)), 1, 4)
  end function plate

  function quarter_cylinder() result(surface)
    type(nurbs_surface_t) :: surface

    surface%axes(1) = uniform_axis(2, 1, 1.0_wp)
    surface%axes(2) = uniform_axis(1, 1, 1.0_wp)
    allocate (surface%points(3, 2, 3), surface%weights(3, 2))
    surface%weights = spread([1.0_wp, sqrt(0.5_wp), 1.0_wp], 2, 2)
    surface%points(:, :, 1) = spread([radius, radius, 0.0_wp], 2, 2)
    surface%points(:, :, 2) = spread([0.0_wp, -radius, -radius], 2, 2)
    surface%points(:, :, 3) = spread([0.0_wp, -20.0_wp], 1, 3)
  end function quarter_cylinder

  function uniform_axis(degree, n, length) result(axis)
    integer, intent(in) :: degree, n
    real(wp), intent(in) :: length
    type(knot_vector_t) :: axis
    type(error_t), allocatable :: error
    integer :: i

    call new_knot_vector(axis, degree, [(0.0_wp, i=1, degree), (length*i/n, i=0, n), &
                                        (length, i=1, degree)], error)
    call check(error)
  end function uniform_axis

  subroutine check(error)
    type(error_t), allocatable, intent(in) :: error

    if (.not. allocated(error)) return
    print "(a)", error%message
    error stop 1
  end subroutine check

end program write_example
