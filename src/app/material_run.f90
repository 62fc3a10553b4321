!> The tests of one material point that a deck asks for, from reading to closing the results.
!!
!! Tests of the laws of users run in a process of their own: wherever the user's code ends the
!! program, the rows up to there are kept and the next test begins.
module material_run
  use, intrinsic :: iso_c_binding, only: c_funloc
  use, intrinsic :: iso_fortran_env, only: error_unit
  use failure, only: error_t
  use input_errors, only: error_list_t, n_errors
  use text, only: string_t, to_text, counted
  use command_line, only: command_t
  use scene, only: scene_t, material_test_spec_t
  use block_law, only: block_law_t
  use user_library, only: user_library_t
  use user_call, only: at_stop
  use user_setup, only: load_user_files
  use deck_reader, only: read_material_deck
  use error_report, only: report_errors
  use material_test, only: new_test_rows, fill_table, table_heads, fill_rows
  use material_point, only: stop_words
  use child_process, only: shared_rows_t, free_rows, is_begun, failure_of, warning_of, &
                           begin_rows, end_rows, is_ended, end_process
  use interrupt, only: watch_signals, stop_signal_name, is_stop_wanted
  use test_process, only: begin_copy, wait_for_end, end_words
  use test_laws, only: law_slot_t, make_laws
  use output_files, only: check_message_file, result_base, files_read, result_path, &
                          path_beside_result, open_message_file, close_message_file
  use hdf5_file, only: hdf5_file_t, create_file, place_file, give_up_file, close_file, flush_file, &
                       take_error, write_text_attribute, write_integer_attribute
  use provenance, only: write_provenance
  use existing_result, only: check_replaceable, test_content
  use unit_system, only: unit_system_t, new_unit_system
  use result_table, only: result_table_t, n_rows, write_csv, write_group
  use run_identity, only: provenance_of
  use exit_codes, only: exit_done, exit_input, exit_numerics, exit_interrupted, exit_files, &
                        status_of
  use return_study, only: run_return_study
  implicit none
  private

  public :: run_material_tests

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
      call print_tests(scene, slots, code)
    else
      code = run_accepted(command, scene, slots)
    end if
  end function run_material_tests

  !> What --check reports, with the tests whose law cannot be called.
  subroutine print_tests(scene, slots, code)
    type(scene_t), intent(in) :: scene
    type(law_slot_t), intent(in) :: slots(:)
    integer, intent(out) :: code
    integer :: i

    code = exit_done
    do i = 1, size(scene%tests)
      associate (test => scene%tests(i))
        print "(a)", "test "//test%name//": "//test%kind//" of "// &
          scene%materials(test%material)%name
        if (.not. allocated(slots(i)%failure)) cycle
        call say(test%name, slots(i)%failure)
        code = exit_numerics
      end associate
    end do
    if (any(slots%is_refused)) code = exit_files
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
      call report_stop(scene, rows, code)
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
  subroutine report_stop(scene, rows, code)
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
  end subroutine report_stop

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
        print "(a)", "test "//test%name//": "//test%kind//", "//counted(n_rows(table), "row")// &
          " in "//path
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
      if (test%is_plane) &
        call write_text_attribute(file, folder, "stress_state", "PLANE STRESS")
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

  !> Carry out all tests, one after the other, until a signal says stop.
  subroutine perform_tests(tests, slots, rows, messages, is_refused)
    type(material_test_spec_t), intent(in) :: tests(:)
    type(law_slot_t), intent(in) :: slots(:)            !! for each test
    type(shared_rows_t), intent(inout) :: rows(:)       !! for each test, with room for it
    character(*), intent(in) :: messages                !! path of the file for unit 7, or empty
    logical, intent(out) :: is_refused                  !! memory, to one of the processes
    logical :: is_going_on
    integer :: i, process, code

    is_refused = any(slots%is_refused)
    is_going_on = .false.
    i = 1
    do while (i <= size(tests) .and. .not. is_stop_wanted())
      process = -1
      call begin_rows(rows(i))
      if (slots(i)%law%needs_context) process = begin_copy()
      if (process < 0) then
        call carry_out(tests(i), slots(i), rows(i))
      else if (process == 0) then
        call open_message_file(messages, is_going_on)
        call go_on(tests(i:), slots(i:), rows(i:))
      else
        call wait_for_end(process, code)
        ! Looked at from here, for this process knows nothing of what the other one wrote.
        call open_message_file(messages, is_going_on=.true.)
        call close_message_file(messages)
        is_going_on = .true.
        do while (is_ended(rows(i)))
          i = i + 1
          if (i > size(tests)) return
        end do
        if (is_stop_wanted() .and. .not. is_begun(rows(i))) return
        is_refused = is_refused .or. code == exit_files
        call end_rows(rows(i), end_words(code)//"; the rows up to there are kept", "")
      end if
      i = i + 1
    end do
  end subroutine perform_tests

  !> In the other process: these tests, with what the subroutines keep from one to the next.
  subroutine go_on(tests, slots, rows)
    type(material_test_spec_t), intent(in) :: tests(:)
    type(law_slot_t), intent(in) :: slots(:)
    type(shared_rows_t), intent(inout) :: rows(:)
    integer :: i

    call watch_signals(c_funloc(at_stop), waits_for_others=.false.)
    do i = 1, size(tests)
      if (is_stop_wanted() .and. i > 1) exit
      call carry_out(tests(i), slots(i), rows(i))
    end do
    call end_process()
  end subroutine go_on

  !> One test, which has failed already where its law cannot be called.
  subroutine carry_out(test, slot, rows)
    type(material_test_spec_t), intent(in) :: test
    type(law_slot_t), intent(in) :: slot
    type(shared_rows_t), intent(inout) :: rows

    if (allocated(slot%failure)) then
      call begin_rows(rows)
      call end_rows(rows, slot%failure, "")
    else
      call fill_rows(test, slot%law, rows)
    end if
  end subroutine carry_out

end module material_run
