!> What a return mapping loses by long strain increments, and what it costs.
!!
!! A row of points is strained along paths of continuously changing direction, and the stresses at
!! their ends are compared with those of very short increments.
module return_study
  use, intrinsic :: iso_fortran_env, only: error_unit, int64
  use kinds, only: wp
  use failure, only: error_t, fail
  use input_errors, only: error_list_t, add_error, n_errors, origin_t, new_origin
  use text, only: to_text, rounded_text, counted
  use command_line, only: command_t
  use scene, only: scene_t, material_spec_t
  use block_law, only: block_law_t
  use law_setup, only: build_law
  use error_report, only: report_errors
  use output_files, only: base_of, result_base, file_name
  use unit_system, only: unit_system_t, new_unit_system
  use result_table, only: result_table_t, write_csv, add_column
  use exit_codes, only: exit_done, exit_input
  use timer, only: clock_ticks, ticks_to_seconds
  use display_grid, only: mises_stress
  implicit none
  private

  public :: run_return_study

  integer, parameter :: stages(7) = [0, 1, 2, 5, 10, 20, 50]   ! 0: backward Euler
  real(wp), parameter :: increments(4) = [1.0e-4_wp, 1.0e-3_wp, 1.0e-2_wp, 1.0e-1_wp]
  integer, parameter :: n_points = 24        !! of the row, as in a forming run
  real(wp), parameter :: path_length = 0.2_wp   !! equivalent strain of each path
  real(wp), parameter :: finest = 2.0e-5_wp     !! increment of the reference

contains

  !> A table for each material with *PLASTIC of a deck that was read, printed and as a CSV file
  !! BASE-returns-NAME.csv; the exit code says how it went.
  integer function run_return_study(command, scene, errors) result(code)
    type(command_t), intent(in) :: command
    type(scene_t), intent(in) :: scene
    type(error_list_t), intent(inout) :: errors    !! of the deck
    type(error_t), allocatable :: error
    character(:), allocatable :: base
    integer :: i

    if (n_errors(errors) == 0) then
      if (.not. any(is_plastic(scene%materials))) call add_error(errors, origin_of(scene), &
        "no material with *PLASTIC to study the return of", &
        "at least one *PLASTIC, of another HARDENING than YOSHIDA UEMORI")
    end if
    call report_errors(errors, error_unit)
    code = merge(exit_input, exit_done, n_errors(errors) > 0)
    if (code == exit_input) return
    base = result_base(command%output)
    if (base == "") base = base_of(file_name(command%deck))
    do i = 1, size(scene%materials)
      if (.not. is_plastic(scene%materials(i))) cycle
      call study(scene%materials(i), base, new_unit_system(scene%units), errors, error)
      if (n_errors(errors) > 0) exit
      if (.not. allocated(error)) cycle
      write (error_unit, "(a)") "igaform: error: material "//scene%materials(i)%name//": "// &
        error%message
      code = exit_input
    end do
    if (n_errors(errors) == 0) return
    call report_errors(errors, error_unit)
    code = exit_input
  end function run_return_study

  !> *PLASTIC with both stress integrations?
  elemental logical function is_plastic(material)
    type(material_spec_t), intent(in) :: material

    is_plastic = material%law == "PLASTIC" .and. material%plasticity%hardening /= "YOSHIDA UEMORI"
  end function is_plastic

  !> Where a deck speaks of materials, for messages.
  pure function origin_of(scene) result(origin)
    type(scene_t), intent(in) :: scene
    type(origin_t) :: origin

    origin = new_origin(scene%file, 0, "")
    if (size(scene%materials) > 0) origin = scene%materials(1)%origin
  end function origin_of

  !> One material.
  subroutine study(given, base, units, errors, error)
    type(material_spec_t), intent(in) :: given
    character(*), intent(in) :: base
    type(unit_system_t), intent(in) :: units
    type(error_list_t), intent(inout) :: errors
    type(error_t), allocatable, intent(out) :: error
    real(wp), parameter :: aligned(6) = [1.0_wp, 0.0_wp, 0.0_wp, 0.0_wp, 1.0_wp, 0.0_wp]
    type(material_spec_t) :: material
    class(block_law_t), allocatable :: law
    real(wp) :: stress(n_points, 6), reference(n_points, 6)
    real(wp), dimension(size(increments), size(stages)) :: deviations, seconds
    integer :: i, k

    material = given
    if (material%plasticity%potential /= "") material%plasticity%orientation = aligned
    do k = 1, size(stages)
      material%plasticity%n_stages = stages(k)
      call build_law(material, law, errors)
      if (.not. allocated(law)) return
      if (stages(k) == 0) call reference_stresses(law, reference, error)
      do i = 1, size(increments)
        if (allocated(error)) return
        call time_paths(law, increments(i), stress, seconds(i, k), error)
        deviations(i, k) = mean_error(stress, reference)
      end do
    end do
    if (allocated(error)) return
    call print_table(material%name, deviations, seconds)
    call write_table(base//"-returns-"//material%name//".csv", units, deviations, seconds, error)
  end subroutine study

  subroutine print_table(name, deviations, seconds)
    character(*), intent(in) :: name
    real(wp), intent(in) :: deviations(:, :), seconds(:, :)   !! (increment, return)
    integer :: i, k

    print "(a)", "material "//name//": error of the stress after curved paths of "// &
      to_text(path_length)//" strain, mean of "//counted(n_points, "point")//","
    print "(a)", "against increments of "//rounded_text(finest)//" extrapolated to zero; "// &
      "ns per point and increment, of this run"
    print "(a,4(es12.0,a))", "increment     ", (increments(i), "      ns", i=1, size(increments))
    do k = 1, size(stages)
      print "(a,4(es12.2,f8.0))", return_name(stages(k)), &
        (deviations(i, k), 1.0e9_wp*seconds(i, k), i=1, size(increments))
    end do
  end subroutine print_table

  pure function return_name(n_stages) result(name)
    integer, intent(in) :: n_stages
    character(14) :: name

    name = "backward Euler"
    if (n_stages > 0) name = counted(n_stages, "stage")
  end function return_name

  subroutine write_table(path, units, deviations, seconds, error)
    character(*), intent(in) :: path
    type(unit_system_t), intent(in) :: units
    real(wp), intent(in) :: deviations(:, :), seconds(:, :)
    type(error_t), allocatable, intent(out) :: error
    type(result_table_t) :: table
    integer :: n

    n = size(deviations)
    call add_column(table, "stages", "1", "stages of the return, 0: backward Euler", &
                    reshape(real(spread(stages, 1, size(increments)), wp), [1, n]))
    call add_column(table, "increment", "1", "equivalent strain of one increment", &
                    reshape(spread(increments, 2, size(stages)), [1, n]))
    call add_column(table, "error", "1", "mean relative error of the stress", &
                    reshape(deviations, [1, n]))
    call add_column(table, "nanoseconds", "1", "time per point and increment", &
                    reshape(1.0e9_wp*seconds, [1, n]))
    call write_csv(table, path, units, error)
  end subroutine write_table

  !> Stresses at the ends of the paths after equal increments, about `increment` long.
  subroutine end_stresses(law, increment, stress, error)
    class(block_law_t), intent(in) :: law
    real(wp), intent(in) :: increment                    !! equivalent strain
    real(wp), intent(out) :: stress(n_points, 6)
    type(error_t), allocatable, intent(out) :: error
    real(wp), dimension(n_points, 6) :: first, last, dstrain
    real(wp) :: state(n_points, law%n_state), spin(n_points, 3), fraction
    integer :: i, n
    logical :: ok

    call draw_directions(first, last)
    n = max(1, nint(path_length/increment))
    stress = 0.0_wp
    state = 0.0_wp
    spin = 0.0_wp
    do i = 1, n
      fraction = (i - 0.5_wp)/n
      dstrain = ((1.0_wp - fraction)*first + fraction*last)*(path_length/n)
      call law%update(n_points, path_length/n, dstrain, stress, state, ok, spin)
      if (.not. ok) then
        call fail(error, "the return did not converge")
        return
      end if
    end do
  end subroutine end_stresses

  !> Stresses that short increments tend to: what two lengths give, extrapolated to zero with the
  !! first order of the method.
  subroutine reference_stresses(law, stress, error)
    class(block_law_t), intent(in) :: law                !! with the backward Euler return
    real(wp), intent(out) :: stress(n_points, 6)
    type(error_t), allocatable, intent(out) :: error
    real(wp) :: coarse(n_points, 6)

    stress = 0.0_wp
    call end_stresses(law, 2.0_wp*finest, coarse, error)
    if (.not. allocated(error)) call end_stresses(law, finest, stress, error)
    stress = 2.0_wp*stress - coarse
  end subroutine reference_stresses

  !> Mean over the points of |stress - reference|/|reference|, in the von Mises norm.
  pure real(wp) function mean_error(stress, reference)
    real(wp), intent(in) :: stress(n_points, 6), reference(n_points, 6)

    mean_error = sum(mises_stress(transpose(stress - reference)) &
                     /mises_stress(transpose(reference)))/n_points
  end function mean_error

  !> Stresses at the ends of the paths, and the time of the law for one point and increment. The
  !! paths are repeated until the time is long enough to measure.
  subroutine time_paths(law, increment, stress, seconds, error)
    class(block_law_t), intent(in) :: law
    real(wp), intent(in) :: increment
    real(wp), intent(out) :: stress(n_points, 6), seconds
    type(error_t), allocatable, intent(out) :: error
    real(wp), parameter :: least = 0.03_wp   ! [s], of a measurement
    real(wp) :: elapsed
    integer(int64) :: started
    integer :: n_repeats

    n_repeats = 0
    elapsed = 0.0_wp
    started = clock_ticks()
    do while (elapsed < least)
      call end_stresses(law, increment, stress, error)
      if (allocated(error)) exit
      n_repeats = n_repeats + 1
      elapsed = ticks_to_seconds(clock_ticks() - started)
    end do
    seconds = elapsed/(real(max(n_repeats, 1), wp)*n_points*max(1, nint(path_length/increment)))
  end subroutine time_paths

  !> Strain directions at the starts and ends of the paths: no change of volume, unit equivalent
  !! strain, spread over all directions by a sequence that is the same on each machine.
  pure subroutine draw_directions(first, last)
    real(wp), dimension(n_points, 6), intent(out) :: first, last
    integer, parameter :: factor = 16807, quotient = 127773, rest = 2836, period = huge(1)
    real(wp) :: e(6)
    integer :: l, k, seed, which

    ! S. K. Park and K. W. Miller, Commun. ACM 31 (1988).
    seed = 1
    do which = 1, 2
      do l = 1, n_points
        do k = 1, 6
          seed = factor*mod(seed, quotient) - rest*(seed/quotient)
          if (seed <= 0) seed = seed + period
          e(k) = 2.0_wp*real(seed, wp)/period - 1.0_wp
        end do
        e(:3) = e(:3) - sum(e(:3))/3.0_wp
        e = e/sqrt(2.0_wp/3.0_wp*(sum(e(:3)**2) + 0.5_wp*sum(e(4:)**2)))
        if (which == 1) first(l, :) = e
        if (which == 2) last(l, :) = e
      end do
    end do
  end subroutine draw_directions

end module return_study
