!> What the returns of a deck's plastic materials lose by long increments, and what they cost:
!! `igaform material DECK --return-study`.
module return_study
  use, intrinsic :: iso_fortran_env, only: error_unit
  use kinds, only: wp
  use failure, only: error_t
  use input_errors, only: error_list_t, origin_t, add_error, new_origin, n_errors
  use text, only: to_text, rounded_text
  use scene, only: scene_t, material_spec_t
  use block_law, only: block_law_t
  use law_setup, only: build_law
  use error_report, only: report_errors
  use unit_system, only: unit_system_t, new_unit_system
  use result_table, only: result_table_t, add_column, write_csv
  use return_error, only: reference_stresses, time_paths, mean_error, n_points, path_length, &
                          finest
  implicit none
  private

  public :: study_returns

  integer, parameter :: stages(7) = [0, 1, 2, 5, 10, 20, 50]   ! 0: backward Euler
  real(wp), parameter :: increments(4) = [1.0e-4_wp, 1.0e-3_wp, 1.0e-2_wp, 1.0e-1_wp]

contains

  !> A table for each material with *PLASTIC, printed and as a CSV file `base`-returns-NAME.csv.
  !! Returns false where one could not be made.
  logical function study_returns(scene, base) result(is_done)
    type(scene_t), intent(in) :: scene
    character(*), intent(in) :: base
    type(error_list_t) :: errors
    type(origin_t) :: origin
    type(error_t), allocatable :: error
    integer :: i, n

    n = 0
    is_done = .true.
    origin = new_origin(scene%file, 0, "")
    if (size(scene%materials) > 0) origin = scene%materials(1)%origin
    do i = 1, size(scene%materials)
      if (scene%materials(i)%law /= "PLASTIC") cycle
      n = n + 1
      call study(scene%materials(i), base, new_unit_system(scene%units), errors, error)
      if (allocated(error)) write (error_unit, "(a)") "igaform: error: material "// &
        scene%materials(i)%name//": "//error%message
      is_done = is_done .and. .not. allocated(error)
    end do
    if (n == 0) call add_error(errors, origin, &
                               "no material with *PLASTIC to study the return of", &
                               "at least one *PLASTIC")
    call report_errors(errors, error_unit)
    is_done = is_done .and. n_errors(errors) == 0
  end function study_returns

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

    print "(a)", "material "//name//": error of the stress after turning paths of "// &
      to_text(path_length)//" strain, mean of "//to_text(n_points)//" points,"
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
    if (n_stages > 0) name = to_text(n_stages)//" stages"
    if (n_stages == 1) name = "1 stage"
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

end module return_study
