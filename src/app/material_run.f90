!> The tests of one material point that a deck asks for, from reading to closing the results. And,
!! for `igaform material DECK --return-study`, the error and cost of the return mappings of its
!! plastic materials in long increments.
module material_run
  use, intrinsic :: iso_c_binding, only: c_funloc
  use, intrinsic :: iso_fortran_env, only: error_unit
  use kinds, only: wp
  use failure, only: error_t
  use input_errors, only: error_list_t, add_error, n_errors, origin_t, new_origin
  use text, only: string_t, to_text, rounded_text
  use command_line, only: command_t
  use scene, only: scene_t, material_spec_t, material_test_spec_t
  use block_law, only: block_law_t
  use user_library, only: user_library_t
  use law_setup, only: build_law
  use user_call, only: at_stop
  use user_law, only: lacks_moduli, find_moduli, first_point_t
  use material_point, only: material_point_t, new_point
  use user_setup, only: load_user_files
  use deck_reader, only: read_material_deck
  use error_report, only: report_errors
  use material_test, only: test_problem, new_test_rows, fill_table, table_heads, stop_words
  use isolated_tests, only: law_slot_t, perform_tests
  use shared_rows, only: shared_rows_t, free_rows, is_begun, failure_of, warning_of
  use interrupt, only: watch_signals, stop_signal_name
  use message_files, only: check_message_file
  use hdf5_file, only: hdf5_file_t, create_file, place_file, give_up_file, close_file, flush_file, &
                       take_error, write_text_attribute, write_integer_attribute
  use provenance_record, only: write_provenance
  use result_guard, only: check_replaceable, test_content
  use unit_system, only: unit_system_t, new_unit_system
  use result_table, only: result_table_t, n_rows, write_csv, write_group, add_column
  use run_identity, only: provenance_of
  use output_names, only: base_of, result_base, file_name, files_read, result_path, &
                          path_beside_result
  use exit_codes, only: exit_done, exit_input, exit_numerics, exit_interrupted, exit_files, &
                        status_of
  use return_error, only: reference_stresses, time_paths, mean_error, n_points, path_length, finest
  implicit none
  private

  public :: run_material_tests

  integer, parameter :: stages(7) = [0, 1, 2, 5, 10, 20, 50]   ! 0: backward Euler
  real(wp), parameter :: increments(4) = [1.0e-4_wp, 1.0e-3_wp, 1.0e-2_wp, 1.0e-1_wp]

contains

  !> Carry out the tests of a deck; the exit code says how it went. Nothing is written before the
  !! deck and all laws are accepted. Each test becomes a group of `/tests` and a CSV file.
  integer function run_material_tests(command) result(code)
    type(command_t), intent(in) :: command
    type(scene_t) :: scene
    type(error_list_t) :: errors
    type(law_slot_t), allocatable :: slots(:)
    type(user_library_t), allocatable :: library

    call read_material_deck(command%deck, command%overrides, .not. command%is_return_study, &
                            scene, errors)
    if (command%is_return_study) then
      code = run_return_study(command, scene, errors)
      return
    end if
    if (n_errors(errors) == 0) call load_user_files(command, scene, library, errors)
    if (n_errors(errors) == 0) call make_laws(scene, slots, errors, library)
    call report_errors(errors, error_unit)
    if (n_errors(errors) > 0) then
      code = exit_input
    else if (command%is_check) then
      call print_tests(scene)
      code = exit_done
    else
      code = run_accepted(command, scene, slots)
    end if
  end function run_material_tests

  !> The study of the returns in place of the tests.
  integer function run_return_study(command, scene, errors) result(code)
    type(command_t), intent(in) :: command
    type(scene_t), intent(in) :: scene
    type(error_list_t), intent(in) :: errors    !! of the deck
    character(:), allocatable :: path

    call report_errors(errors, error_unit)
    code = exit_input
    if (n_errors(errors) > 0) return
    path = result_base(command%output)
    if (path == "") path = base_of(file_name(command%deck))
    if (study_returns(scene, path)) code = exit_done
  end function run_return_study

  !> The law of each test, with its constants checked. Tests lie in the axes of the material, so
  !! its *ORIENTATION, which says how it lies in a blank, does not matter here.
  subroutine make_laws(scene, slots, errors, library)
    type(scene_t), intent(in) :: scene
    type(law_slot_t), allocatable, intent(out) :: slots(:)
    type(error_list_t), intent(inout) :: errors
    type(user_library_t), intent(in), optional :: library   !! for *USER MATERIAL
    real(wp), parameter :: short = 1.0e-9_wp                ! time of a first call, for the moduli
    real(wp), parameter :: aligned(6) = [1.0_wp, 0.0_wp, 0.0_wp, 0.0_wp, 1.0_wp, 0.0_wp]
    type(material_spec_t) :: material
    character(:), allocatable :: reason
    integer :: i, first

    allocate (slots(size(scene%tests)))
    do i = 1, size(scene%tests)
      associate (test => scene%tests(i))
        first = minloc(abs(scene%tests%material - test%material), 1)
        if (first == i) then
          material = scene%materials(test%material)
          if (material%plasticity%potential /= "") material%plasticity%orientation = aligned
          call build_law(material, slots(i)%law, errors, library)
          if (allocated(slots(i)%law)) call ask_law(test, material, short, slots(i)%law, errors)
        else if (allocated(slots(first)%law)) then
          allocate (slots(i)%law, source=slots(first)%law)
        end if
        if (.not. allocated(slots(i)%law)) cycle
        reason = test_problem(test, slots(i)%law)
        if (reason /= "") call add_error(errors, test%origin, reason, "a law with plasticity")
        associate (n => slots(i)%law%n_state - slots(i)%law%n_hidden)
          if (first == i .and. size(test%state) > n) call add_error(errors, test%state_origin, &
            to_text(size(test%state))//" state variables for ALL", to_text(n)//" at most, as "// &
            "material "//scene%materials(test%material)%name//" has")
        end associate
      end associate
    end do
  end subroutine make_laws

  !> Let a user's law without elastic moduli in the deck report them, at the start of a test.
  subroutine ask_law(test, material, dt, law, errors)
    type(material_test_spec_t), intent(in) :: test
    type(material_spec_t), intent(in) :: material
    real(wp), intent(in) :: dt
    class(block_law_t), allocatable, intent(inout) :: law   !! freed where it has none
    type(error_list_t), intent(inout) :: errors
    type(first_point_t) :: first
    type(material_point_t) :: point
    type(error_t), allocatable :: error
    real(wp) :: bulk, shear

    if (.not. lacks_moduli(law)) return
    point = new_point(law, test%state, test%fields)
    first%n_fields = size(test%fields)
    first%fields(:first%n_fields) = test%fields
    call find_moduli(law, dt, first, point%state, bulk, shear, error)
    law%bulk = bulk
    law%shear = shear
    if (.not. allocated(error)) return
    call add_error(errors, material%origin, error%message, "a law that can be called")
    deallocate (law)
  end subroutine ask_law

  !> What --check reports.
  subroutine print_tests(scene)
    type(scene_t), intent(in) :: scene
    integer :: i

    do i = 1, size(scene%tests)
      associate (test => scene%tests(i))
        print "(a)", "test "//test%name//": "//test%kind//" of "// &
          scene%materials(test%material)%name
      end associate
    end do
  end subroutine print_tests

  !> All tests of an accepted deck, one after the other; one that fails does not stop the rest, a
  !! signal does. The files are written when all is done: what ends in a user's subroutine has none
  !! open.
  integer function run_accepted(command, scene, slots) result(code)
    type(command_t), intent(in) :: command
    type(scene_t), intent(in) :: scene
    type(law_slot_t), intent(in) :: slots(:)
    type(shared_rows_t) :: rows(size(slots))
    type(string_t), allocatable :: read_files(:)
    type(error_t), allocatable :: error
    character(:), allocatable :: path, messages
    logical :: is_refused
    integer :: i

    code = exit_input
    read_files = files_read(command, scene)
    messages = ""
    call result_path(command, read_files, path, error)
    if (.not. allocated(error)) call check_replaceable(path, test_content, error)
    if (.not. allocated(error) .and. any([(slots(i)%law%needs_context, i=1, size(slots))])) then
      messages = path_beside_result(path, ".msg", read_files)
      call check_message_file(messages, error)
    end if
    do i = 1, size(slots)
      if (allocated(error)) exit
      call new_test_rows(scene%tests(i), slots(i)%law, rows(i), error)
      if (allocated(error)) code = exit_files
    end do
    if (.not. allocated(error)) then
      call watch_signals(c_funloc(at_stop), waits_for_others=.true.)
      call perform_tests(scene%tests, slots, rows, messages, is_refused)
      call tell_of_stop(scene, rows, code)
      if (is_begun(rows(1))) &
        call write_all(command, scene, slots, rows, path, read_files, code, error)
      if (is_refused) code = exit_files
    end if
    if (allocated(error)) write (error_unit, "(a)") "igaform: error: "//error%message
    do i = 1, size(slots)
      call free_rows(rows(i))
    end do
  end function run_accepted

  !> Name the signal that has left tests undone, and these tests.
  subroutine tell_of_stop(scene, rows, code)
    type(scene_t), intent(in) :: scene
    type(shared_rows_t), intent(in) :: rows(:)
    integer, intent(inout) :: code           !! set where there are any
    character(:), allocatable :: names
    logical :: is_cut
    integer :: i

    names = ""
    is_cut = .false.
    do i = 1, size(rows)
      is_cut = is_cut .or. code_of(rows(i)) == exit_interrupted
      if (.not. is_begun(rows(i))) names = names//", "//scene%tests(i)%name
    end do
    if (.not. is_cut) return
    if (names /= "") names = "; tests not begun: "//names(3:)
    write (error_unit, "(a)") "igaform: stopped by "//stop_signal_name()//names
    code = exit_interrupted
  end subroutine tell_of_stop

  !> How a test ended, as an exit code.
  integer function code_of(rows) result(code)
    type(shared_rows_t), intent(in) :: rows

    code = exit_done
    if (failure_of(rows) /= "") code = exit_numerics
    if (index(failure_of(rows), stop_words) == 1 .or. .not. is_begun(rows)) code = exit_interrupted
  end function code_of

  !> What the tests have found, to the result file and the CSV files.
  subroutine write_all(command, scene, slots, rows, path, read_files, code, error)
    type(command_t), intent(in) :: command
    type(scene_t), intent(in) :: scene
    type(law_slot_t), intent(in) :: slots(:)
    type(shared_rows_t), intent(in) :: rows(:)
    character(*), intent(in) :: path             !! of the result
    type(string_t), intent(in) :: read_files(:)
    integer, intent(inout) :: code
    type(error_t), allocatable, intent(out) :: error
    type(hdf5_file_t) :: file
    type(unit_system_t) :: units
    character(:), allocatable :: table
    integer :: i, worst

    units = new_unit_system(scene%units)
    call create_file(file, path, is_draft=.true., content=test_content)
    call write_provenance(file, provenance_of(scene))
    call take_error(file, error)
    if (allocated(error)) call give_up_file(file)
    if (allocated(error)) return
    code = exit_done
    worst = exit_done
    do i = 1, size(scene%tests)
      worst = max(worst, code_of(rows(i)))
      if (.not. is_begun(rows(i))) cycle
      table = result_base(path)//"-"//underscored(scene%tests(i)%name)//".h5"
      table = path_beside_result(table, ".csv", read_files)
      call write_test(scene, i, slots(i)%law, rows(i), file, table, units, command%is_quiet, code)
    end do
    if (worst == exit_interrupted .and. code /= exit_files) code = exit_interrupted
    call write_text_attribute(file, "/provenance", "status", status_of(worst))
    call flush_file(file)
    call place_file(file)
    call take_error(file, error)
    if (allocated(error)) then
      code = exit_files
      call give_up_file(file)
    else
      call close_file(file)
    end if
  end subroutine write_all

  !> One test: its rows to the result file and to a CSV file of its own.
  subroutine write_test(scene, i, law, rows, file, path, units, is_quiet, code)
    type(scene_t), intent(in) :: scene
    integer, intent(in) :: i
    class(block_law_t), intent(in) :: law
    type(shared_rows_t), intent(in) :: rows
    type(hdf5_file_t), intent(inout) :: file
    character(*), intent(in) :: path       !! of the CSV file
    type(unit_system_t), intent(in) :: units
    logical, intent(in) :: is_quiet
    integer, intent(inout) :: code         !! set where something fails
    type(result_table_t) :: table
    type(error_t), allocatable :: error
    character(:), allocatable :: failure, warning

    failure = failure_of(rows)
    warning = warning_of(rows)
    associate (test => scene%tests(i))
      call fill_table(test, law, rows, table)
      if (warning /= "") &
        write (error_unit, "(a)") "igaform: warning: test "//test%name//": "//warning
      call record(scene, i, file, table, units, status_of(code_of(rows)))
      call write_csv(table, path, units, error, table_heads())
      if (.not. (is_quiet .or. allocated(error))) then
        print "(a)", "test "//test%name//": "//test%kind//", "//to_text(n_rows(table))// &
          " rows in "//path
      end if
      if (failure /= "") call say(test%name, failure)
      if (allocated(error)) call say(test%name, error%message)
      if (allocated(error) .and. code == exit_done) code = exit_files
      if (failure /= "") code = exit_numerics
    end associate
  end subroutine write_test

  !> Group of one test with what was tested and how.
  subroutine record(scene, i, file, table, units, status)
    type(scene_t), intent(in) :: scene
    integer, intent(in) :: i
    type(hdf5_file_t), intent(inout) :: file
    type(result_table_t), intent(in) :: table
    type(unit_system_t), intent(in) :: units
    character(*), intent(in) :: status
    character(:), allocatable :: folder

    associate (test => scene%tests(i))
      folder = "/tests/"//test%name
      call write_group(table, file, folder, units)
      call write_integer_attribute(file, folder, "number", [i])
      call write_text_attribute(file, folder, "type", test%kind)
      call write_text_attribute(file, folder, "material", scene%materials(test%material)%name)
      call write_text_attribute(file, folder, "angle", to_text(test%angle))
    end associate
    call write_text_attribute(file, folder, "status", status)
  end subroutine record

  subroutine say(name, message)
    character(*), intent(in) :: name, message

    write (error_unit, "(a)") "igaform: error: test "//name//": "//message
  end subroutine say

  !> The name with underscores for blanks, for the name of a file.
  pure function underscored(name) result(word)
    character(*), intent(in) :: name
    character(len(name)) :: word
    integer :: i

    word = name
    do i = 1, len(name)
      if (name(i:i) == " ") word(i:i) = "_"
    end do
  end function underscored

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

end module material_run
