!> Tests of a law on one material point: tension, shear, cycles and the like as rows against time,
!! r-values over the angle to the rolling direction, a section of the yield surface, limit strains.
module material_test
  use kinds, only: wp
  use failure, only: error_t, fail
  use text, only: strings, string_t, to_text, rounded_text
  use interrupt, only: is_stop_wanted
  use scene, only: material_test_spec_t
  use block_law, only: block_law_t
  use simple_shear, only: simple_shear_of, shear_limit
  use material_point, only: material_point_t, control_t, new_point, new_control, advance, &
                            strain_to_frame, stress_to_frame, plastic_strain, stop_words
  use forming_limit, only: limit_t, find_limit, stress_at, ratio_of
  use result_table, only: result_table_t, add_column, tensor_components
  use child_process, only: shared_rows_t, new_rows, begin_rows, add_row, end_rows, values_of
  implicit none
  private

  public :: test_problem, new_test_rows, fill_rows, fill_table, table_heads

  real(wp), parameter :: degree = acos(-1.0_wp)/180.0_wp
  !> Tests of plastic flow.
  character(13), parameter :: needs_flow(4) = [character(13) :: "R VALUES", "YIELD LOCUS", &
                                               "FORMING LIMIT", "LIMIT STRESS"]
  integer, parameter :: n_fixed = 13   ! time, strain and stress in front of the state in a row

  !> What controls the point: conditions, and their values at the corners of the path.
  type :: program_t
    type(control_t) :: control
    logical :: is_stress(6) = .false.        !! the condition is on the stress
    real(wp), allocatable :: corners(:, :)   !! values of the conditions, shape (6, corners)
    real(wp), allocatable :: times(:)        !! of the corners; the start is at 0
    real(wp) :: spin(3) = 0.0_wp             !! for each unit of the fourth condition
  end type program_t

contains

  !> Why this law cannot go through this test; empty where it can.
  pure function test_problem(spec, law) result(reason)
    type(material_test_spec_t), intent(in) :: spec
    class(block_law_t), intent(in) :: law
    character(:), allocatable :: reason

    reason = ""
    if (any(spec%kind == needs_flow) .and. law%eqps_state == 0) then
      reason = "TYPE="//spec%kind//" of a material that reports no plastic strain: "
      if (law%needs_context) then
        reason = reason//"no state variable of its *DEPVAR is named EQPS or PEEQ"
      else
        reason = reason//"it has no *PLASTIC"
      end if
    end if
  end function test_problem

  !> Room for the rows of a test. Fails if there is no memory.
  subroutine new_test_rows(spec, law, rows, error)
    type(material_test_spec_t), intent(in) :: spec
    class(block_law_t), intent(in) :: law
    type(shared_rows_t), intent(out) :: rows
    type(error_t), allocatable, intent(out) :: error
    type(program_t) :: program
    integer :: n_columns, n_most

    select case (spec%kind)
    case ("R VALUES")
      n_columns = 3
      n_most = spec%n_repeats
    case ("LIMIT STRESS")
      n_columns = 4
      n_most = size(spec%limits, 2)
    case ("YIELD LOCUS", "FORMING LIMIT")
      n_columns = merge(4, 6, spec%kind == "YIELD LOCUS")
      n_most = spec%n_repeats
    case default
      program = new_program(spec)
      n_columns = n_fixed + law%n_state - law%n_hidden
      n_most = spec%n_increments*size(program%times) + 1
    end select
    if (.not. new_rows(rows, n_columns, n_most)) &
      call fail(error, "out of memory: "//rounded_text(8.0_wp*n_most*n_columns)// &
                " bytes more were asked for, for "//to_text(n_most)//" rows of a test")
  end subroutine new_test_rows

  !> Carry out a test, row by row. Where the point cannot be taken further the rows end, with the
  !! reason. A process may do this for another one, which has allocated the rows.
  subroutine fill_rows(spec, law, rows)
    type(material_test_spec_t), intent(in) :: spec
    class(block_law_t), intent(in) :: law
    type(shared_rows_t), intent(inout) :: rows
    type(material_point_t) :: point
    type(error_t), allocatable :: error
    character(:), allocatable :: warning
    real(wp) :: shear

    call begin_rows(rows)
    warning = ""
    select case (spec%kind)
    case ("R VALUES")
      call find_r_values(spec, law, rows, error)
    case ("YIELD LOCUS")
      call find_yield_locus(spec, law, rows, error)
    case ("FORMING LIMIT")
      call find_limits(spec, law, rows, error)
    case ("LIMIT STRESS")
      call convert_limits(spec, law, rows, error)
    case default
      call follow(new_program(spec), law, spec, point, shear, error, rows)
      if (shear > shear_limit .and. law%shear_warning() /= "") &
        warning = "the point sheared by "//rounded_text(shear)//": "//law%shear_warning()
    end select
    if (.not. allocated(error)) allocate (error, source=error_t(""))
    call end_rows(rows, error%message, warning)
  end subroutine fill_rows

  !> How the first line of a table of each type begins, whatever the units and the state variables
  !! of the law.
  function table_heads() result(heads)
    type(string_t), allocatable :: heads(:)

    heads = strings([character(200) :: &
      "time [],strain_11 [],strain_22 [],strain_33 [],strain_12 [],strain_13 [],strain_23 [],"// &
      "stress_11 [],stress_22 [],stress_33 [],stress_12 [],stress_13 [],stress_23 [],eqps []", &
      "angle [],r_value [],stress []", "direction [],stress_11 [],stress_22 [],eqps []", &
      "minor [],major [],ratio [],groove []", "minor [],major [],stress_minor []"])
  end function table_heads

  !> The rows as a table with names and units.
  subroutine fill_table(spec, law, rows, table)
    type(material_test_spec_t), intent(in) :: spec
    class(block_law_t), intent(in) :: law
    type(shared_rows_t), intent(in) :: rows
    type(result_table_t), intent(out) :: table

    associate (values => values_of(rows))
      select case (spec%kind)
      case ("R VALUES")
        call add_column(table, "angle", "1", "degrees from axis 1 of the material to the pull", &
                        values(1:1, :))
        call add_column(table, "r_value", "1", "plastic strain across over plastic strain "// &
                        "through the thickness, at the end", values(2:2, :))
        call add_column(table, "stress", "stress", "Cauchy stress along the pull at the end", &
                        values(3:3, :))
      case ("YIELD LOCUS")
        call add_column(table, "direction", "1", "degrees in the plane of s11 and s22, from s11", &
                        values(1:1, :))
        call add_column(table, "stress", "stress", "stresses at first yield, s33 and shear "// &
                        "being zero: 11, 22", values(2:3, :), strings(["11", "22"]))
        call add_column(table, "eqps", "1", "plastic strain reached", values(4:4, :))
      case ("FORMING LIMIT")
        call add_limits(values, table)
        call add_column(table, "ratio", "1", "minor over major strain", values(3:3, :))
        call add_column(table, "groove", "1", "degrees from the major strain to the normal of "// &
                        "the groove that fails first, at the end", values(4:4, :))
        call add_limit_stresses(values(5:6, :), table)
      case ("LIMIT STRESS")
        call add_limits(values, table)
        call add_limit_stresses(values(3:4, :), table)
      case default
        call fill_history(values, law, spec, table)
      end select
    end associate
  end subroutine fill_table

  !> Limit strains, first in each row.
  subroutine add_limits(values, table)
    real(wp), intent(in) :: values(:, :)
    type(result_table_t), intent(inout) :: table

    call add_column(table, "minor", "1", "minor strain at the limit, logarithmic", values(1:1, :))
    call add_column(table, "major", "1", "major strain at the limit", values(2:2, :))
  end subroutine add_limits

  subroutine add_limit_stresses(stresses, table)
    real(wp), intent(in) :: stresses(:, :)     !! minor first
    type(result_table_t), intent(inout) :: table

    call add_column(table, "stress", "stress", "principal stresses of the sheet at the limit", &
                    stresses, strings(["minor", "major"]))
  end subroutine add_limit_stresses

  pure function new_program(spec) result(program)
    type(material_test_spec_t), intent(in) :: spec
    type(program_t) :: program
    logical, parameter :: pulled(6) = [.false., .true., .true., .true., .true., .true.]
    real(wp) :: strains(6, 6), stresses(6, 6)
    integer :: i

    program%is_stress = pulled
    allocate (program%corners(6, 1), source=0.0_wp)
    program%corners(1, 1) = spec%strain
    select case (spec%kind)
    case ("COMPRESSION")
      program%is_stress = pulled([3, 2, 1, 4, 5, 6])
      program%corners(:, 1) = 0.0_wp
      program%corners(3, 1) = -abs(spec%strain)
    case ("CYCLIC")
      program%corners = spread([spec%strain, 0.0_wp, 0.0_wp, 0.0_wp, 0.0_wp, 0.0_wp], 2, &
                               2*spec%n_repeats + 1)
      program%corners(1, 2::2) = -spec%strain
    case ("SIMPLE SHEAR")
      program%is_stress = .false.
      program%corners(:, 1) = 0.0_wp
      program%corners(4, 1) = spec%strain
      program%spin(1) = 0.5_wp
    case ("PLANE STRAIN")
      program%is_stress([2, 4]) = .false.
    case ("PATH")
      program%is_stress = spec%is_stress
      program%corners = spec%path(2:, :)
      program%times = spec%path(1, :)
    end select
    if (spec%is_plane) program%is_stress([3, 5, 6]) = .true.
    program%control = new_control(program%is_stress, degree*spec%angle)
    if (spec%kind == "EQUIBIAXIAL") then
      strains = strain_to_frame(degree*spec%angle)
      stresses = stress_to_frame(degree*spec%angle)
      program%control%on_strain(1, :) = 0.5_wp*(strains(1, :) + strains(2, :))
      program%control%on_stress(2, :) = stresses(1, :) - stresses(2, :)
    end if
    if (allocated(program%times)) return
    program%times = [(abs(spec%strain)*(2*i - 1)/spec%rate, i=1, size(program%corners, 2))]
  end function new_program

  !> Take a new point from corner to corner, with the increments of the test to each.
  subroutine follow(program, law, spec, point, shear, error, rows)
    type(program_t), intent(in) :: program
    class(block_law_t), intent(in) :: law
    type(material_test_spec_t), intent(in) :: spec
    type(material_point_t), intent(out) :: point
    real(wp), intent(out) :: shear                         !! the largest, as simple shear
    type(error_t), allocatable, intent(out) :: error
    type(shared_rows_t), intent(inout), optional :: rows   !! one for each increment, and the start
    real(wp) :: start(6), aim(6), change(6), dt, before
    integer :: corner, i, n

    n = spec%n_increments*size(program%times)
    point = new_point(law, spec%state, spec%fields, spec%is_plane)
    shear = 0.0_wp
    call note()
    start = 0.0_wp
    before = 0.0_wp
    do corner = 1, size(program%times)
      change = (program%corners(:, corner) - start)/spec%n_increments
      dt = (program%times(corner) - before)/spec%n_increments
      do i = 1, spec%n_increments
        if (is_stop_wanted()) then
          call fail(error, stop_words//" before increment "//to_text(point%increment + 1)// &
                    " of "//to_text(n)//"; the rows up to there are kept")
          return
        end if
        aim = merge(start + i*change, change, program%is_stress)
        call advance(law, program%control, aim, program%spin*change(4), dt, point, error)
        if (allocated(error)) then
          error%message = error%message//" (increment "//to_text(point%increment + 1)//" of "// &
                          to_text(n)//"); more increments may help"
          return
        end if
        shear = max(shear, simple_shear_of(point%gradient))
        call note()
      end do
      start = program%corners(:, corner)
      before = program%times(corner)
    end do

  contains

    subroutine note()
      if (present(rows)) call add_row(rows, [point%time, point%strain, point%stress, &
                                             point%state(:law%n_state - law%n_hidden)])
    end subroutine note
  end subroutine follow

  !> The rows of `follow` as columns, stress and strain in the frame of the test.
  subroutine fill_history(history, law, spec, table)
    real(wp), intent(in) :: history(:, :)
    class(block_law_t), intent(in) :: law
    type(material_test_spec_t), intent(in) :: spec
    type(result_table_t), intent(out) :: table
    type(string_t) :: names(law%n_state - law%n_hidden)
    real(wp) :: eqps(1, size(history, 2)), angle
    integer :: i

    angle = degree*spec%angle
    eqps = 0.0_wp
    if (law%eqps_state > 0) eqps(1, :) = history(n_fixed + law%eqps_state, :)
    do i = 1, size(names)
      names(i)%value = to_text(i)
      if (law%has_damage .and. i == size(names)) names(i)%value = "damage"
    end do
    if (allocated(spec%state_names)) then
      do i = 1, min(size(names), size(spec%state_names))
        names(i)%value = spec%state_names(i)%value
      end do
    end if
    call add_column(table, "time", "time", "time", history(:1, :))
    call add_column(table, "strain", "1", "sum of the strain increments in the frame of the "// &
                    "test, engineering shear: 11, 22, 33, 12, 13, 23", &
                    matmul(strain_to_frame(angle), history(2:7, :)), tensor_components())
    call add_column(table, "stress", "stress", "Cauchy stress in the frame of the test: 11, "// &
                    "22, 33, 12, 13, 23", &
                    matmul(stress_to_frame(angle), history(8:13, :)), tensor_components())
    call add_column(table, "eqps", "1", "equivalent plastic strain", eqps)
    call add_column(table, "state", "1", "state variables of the law", &
                    history(n_fixed + 1:, :), names)
  end subroutine fill_history

  !> Tension at angles from 0 to 90 degrees to axis 1 of the material: stress at the end and
  !! r = plastic strain across over that through the thickness.
  subroutine find_r_values(spec, law, rows, error)
    type(material_test_spec_t), intent(in) :: spec
    class(block_law_t), intent(in) :: law
    type(shared_rows_t), intent(inout) :: rows
    type(error_t), allocatable, intent(out) :: error
    real(wp), parameter :: round_off = 1.0e-6_wp
    real(wp) :: plastic(6), rotated(6), shear
    type(material_test_spec_t) :: tension
    type(material_point_t) :: start, point
    integer :: i, n

    start = new_point(law, spec%state, spec%fields, spec%is_plane)
    tension = spec
    tension%kind = "UNIAXIAL"
    n = spec%n_repeats
    do i = 1, n
      tension%angle = 90.0_wp*(i - 1)/(n - 1)
      call follow(new_program(tension), law, spec, point, shear, error)
      if (allocated(error)) return
      plastic = matmul(strain_to_frame(degree*tension%angle), plastic_strain(law, point))
      ! Yielded by its law, and by a plastic strain beyond round-off?
      if (.not. (point%state(law%eqps_state) > start%state(law%eqps_state) .and. &
                 abs(plastic(3)) > round_off*maxval(abs(point%strain)))) then
        call fail(error, "no plastic strain in tension at "//to_text(tension%angle)// &
                  " degrees, so no r-value")
        return
      end if
      rotated = matmul(stress_to_frame(degree*tension%angle), point%stress)
      call add_row(rows, [tension%angle, plastic(2)/plastic(3), rotated(1)])
    end do
  end subroutine find_r_values

  !> Stresses s11, s22 at which a plastic strain first shows, s33 and shear being zero. The stress
  !! keeps its direction while strain steps double, then are halved back to the threshold.
  subroutine find_yield_locus(spec, law, rows, error)
    type(material_test_spec_t), intent(in) :: spec
    class(block_law_t), intent(in) :: law
    type(shared_rows_t), intent(inout) :: rows
    type(error_t), allocatable, intent(out) :: error
    type(material_point_t) :: point
    integer :: i, n

    n = spec%n_repeats
    do i = 1, n
      call find_yield(law, degree*360.0_wp*(i - 1)/n, spec, point, error)
      if (allocated(error)) return
      associate (rotated => matmul(stress_to_frame(degree*spec%angle), point%stress))
        call add_row(rows, [360.0_wp*(i - 1)/n, rotated(:2), point%state(law%eqps_state)])
      end associate
    end do
  end subroutine find_yield_locus

  !> Limit strains of paths from uniaxial tension to equal strains, see `forming_limit`.
  subroutine find_limits(spec, law, rows, error)
    type(material_test_spec_t), intent(in) :: spec
    class(block_law_t), intent(in) :: law
    type(shared_rows_t), intent(inout) :: rows
    type(error_t), allocatable, intent(out) :: error
    type(limit_t) :: limit
    real(wp) :: ratio
    integer :: i

    do i = 1, spec%n_repeats
      ratio = ratio_of(i, spec%n_repeats)
      call find_limit(spec, law, ratio, limit, error)
      if (allocated(error)) return
      call add_row(rows, [ratio*limit%strain, limit%strain, ratio, limit%groove, limit%stress])
    end do
  end subroutine find_limits

  !> Stresses of the sheet at limit strains that the deck gives, on proportional paths.
  subroutine convert_limits(spec, law, rows, error)
    type(material_test_spec_t), intent(in) :: spec
    class(block_law_t), intent(in) :: law
    type(shared_rows_t), intent(inout) :: rows
    type(error_t), allocatable, intent(out) :: error
    real(wp) :: stress(2)
    integer :: i

    do i = 1, size(spec%limits, 2)
      call stress_at(spec, law, spec%limits(:, i), stress, error)
      if (allocated(error)) return
      call add_row(rows, [spec%limits(:, i), stress])
    end do
  end subroutine convert_limits

  !> From zero along one direction of stress until the plastic strain passes the threshold.
  subroutine find_yield(law, direction, spec, point, error)
    class(block_law_t), intent(in) :: law
    real(wp), intent(in) :: direction              !! [radians]
    type(material_test_spec_t), intent(in) :: spec
    type(material_point_t), intent(out) :: point   !! just beyond the threshold
    type(error_t), allocatable, intent(out) :: error
    real(wp), parameter :: first_step = 1.0e-5_wp, last_step = 1.0e-8_wp, far = 1.0_wp
    real(wp) :: aim(6), rows(6, 6), step, travel
    type(material_point_t) :: next
    type(control_t) :: control
    logical :: is_beyond

    control = new_control([.false., .true., .true., .true., .true., .true.], &
                          degree*spec%angle)
    rows = strain_to_frame(degree*spec%angle)
    control%on_strain(1, :) = cos(direction)*rows(1, :) + sin(direction)*rows(2, :)
    rows = stress_to_frame(degree*spec%angle)
    control%on_stress(2, :) = cos(direction)*rows(2, :) - sin(direction)*rows(1, :)
    point = new_point(law, spec%state, spec%fields, spec%is_plane)
    aim = 0.0_wp
    step = first_step
    travel = 0.0_wp
    is_beyond = .false.
    do
      if (is_stop_wanted()) then
        call fail(error, stop_words//" at the direction of "//to_text(nint(direction/degree))// &
                  " degrees; the rows up to there are kept")
        return
      end if
      next = point
      aim(1) = step
      call advance(law, control, aim, [0.0_wp, 0.0_wp, 0.0_wp], step/spec%rate, next, error)
      if (allocated(error)) return
      if (next%state(law%eqps_state) > spec%threshold) then
        is_beyond = .true.
        if (step <= min(last_step, 0.1_wp*spec%threshold)) exit
        step = 0.5_wp*step
      else
        point = next
        travel = travel + step
        if (is_beyond) cycle
        step = 2.0_wp*step
        if (travel > far) then
          call fail(error, "no plastic strain along "// &
                    to_text(nint(direction/degree))//" degrees")
          return
        end if
      end if
    end do
    point = next
  end subroutine find_yield

end module material_test
