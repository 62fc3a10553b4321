!> The tests of one material point that a deck asks for, from reading to closing the results.
!!
!! Tests of the laws of users run in a process of their own: wherever the user's code ends the
!! program, the rows up to there are kept and the next test begins.
module material_run
  use, intrinsic :: iso_c_binding, only: c_funloc
  use, intrinsic :: iso_fortran_env, only: error_unit
  use kinds, only: wp
  use failure, only: error_t
  use input_errors, only: error_list_t, add_error, n_errors
  use text, only: string_t, to_text
  use command_line, only: command_t
  use scene, only: scene_t, material_spec_t, material_test_spec_t
  use block_law, only: block_law_t
  use user_library, only: user_library_t
  use law_setup, only: build_law, refuse_call
  use user_call, only: at_stop, forget_thread
  use user_law, only: lacks_moduli, find_moduli, first_point_t
  use material_point, only: material_point_t, new_point
  use user_setup, only: load_user_files
  use deck_reader, only: read_material_deck
  use error_report, only: report_errors
  use material_test, only: test_problem, new_test_rows, fill_table, table_heads, stop_words, &
                           fill_rows
  use child_process, only: shared_rows_t, free_rows, is_begun, failure_of, warning_of, &
                           begin_rows, end_rows, is_ended, fork_process, has_ended, send_signal, &
                           stop_signal, insist_on_end, pause_briefly, end_with_parent, end_process
  use interrupt, only: watch_signals, stop_signal_name, is_stop_wanted, is_end_wanted
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

  !> The law of a test.
  type :: law_slot_t
    class(block_law_t), allocatable :: law
  end type law_slot_t

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
        first = findloc(scene%tests%material == test%material .and. &
                        (scene%tests%is_plane .eqv. test%is_plane), .true., 1)
        if (first == i) then
          material = scene%materials(test%material)
          material%is_sheet = test%is_plane
          if (material%plasticity%potential /= "") material%plasticity%orientation = aligned
          call build_law(material, slots(i)%law, errors, library, n_given(test))
          if (allocated(slots(i)%law)) call ask_law(test, material, short, slots(i)%law, errors)
        else if (allocated(slots(first)%law)) then
          allocate (slots(i)%law, source=slots(first)%law)
        end if
        if (.not. allocated(slots(i)%law)) cycle
        reason = test_problem(test, slots(i)%law)
        if (reason /= "") call add_error(errors, test%origin, reason, "a law with plasticity")
        associate (n => slots(i)%law%n_state - slots(i)%law%n_hidden - &
                       scene%materials(test%material)%n_uvarm)
          if (findloc(scene%tests%material, test%material, 1) == i .and. size(test%state) > n) &
            call add_error(errors, test%state_origin, to_text(size(test%state))// &
                           " state variables for ALL", to_text(n)//" at most, as material "// &
                           scene%materials(test%material)%name//" has")
        end associate
      end associate
    end do
  end subroutine make_laws

  !> Temperature and field variables that a test gives.
  pure integer function n_given(test)
    type(material_test_spec_t), intent(in) :: test

    n_given = 0
    if (allocated(test%fields)) n_given = size(test%fields)
  end function n_given

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
    point = new_point(law, test%state, test%fields, test%is_plane)
    first%n_fields = size(test%fields)
    first%fields(:first%n_fields) = test%fields
    call find_moduli(law, dt, first, point%state, bulk, shear, error)
    law%bulk = bulk
    law%shear = shear
    if (.not. allocated(error)) return
    call refuse_call(material, error, errors)
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

    is_refused = .false.
    is_going_on = .false.
    i = 1
    do while (i <= size(tests) .and. .not. is_stop_wanted())
      process = -1
      call begin_rows(rows(i))
      if (slots(i)%law%needs_context) then
        call flush_units()    ! else both processes would write what waits there
        process = fork_process()
      end if
      if (process < 0) then
        call fill_rows(tests(i), slots(i)%law, rows(i))
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
        call end_rows(rows(i), end_words(code), "")
      end if
      i = i + 1
    end do
  end subroutine perform_tests

  !> Wait for the end of the other process, which is asked to stop where a signal says so.
  subroutine wait_for_end(process, code)
    integer, intent(in) :: process
    integer, intent(out) :: code
    logical :: is_asked
    integer :: n_asked

    is_asked = .false.
    n_asked = 0
    do while (.not. has_ended(process, code))
      if (is_end_wanted()) then
        call insist_on_end(process, n_asked)
      else if (is_stop_wanted() .and. .not. is_asked) then
        is_asked = .true.
        call send_signal(process, stop_signal)
      end if
      call pause_briefly()
    end do
  end subroutine wait_for_end

  !> In the other process: these tests, with what the subroutines keep from one to the next.
  subroutine go_on(tests, slots, rows)
    type(material_test_spec_t), intent(in) :: tests(:)
    type(law_slot_t), intent(in) :: slots(:)
    type(shared_rows_t), intent(inout) :: rows(:)
    integer :: i

    call end_with_parent()
    call forget_thread()
    call watch_signals(c_funloc(at_stop), waits_for_others=.false.)
    do i = 1, size(tests)
      if (is_stop_wanted() .and. i > 1) exit
      call fill_rows(tests(i), slots(i)%law, rows(i))
    end do
    call end_process()
  end subroutine go_on

  !> How a test ended that has not reported its end.
  function end_words(code) result(words)
    integer, intent(in) :: code    !! exit code, or 128 and the number of the signal
    character(:), allocatable :: words

    if (is_stop_wanted() .and. (code >= 128 .or. code == exit_interrupted)) then
      words = stop_words//" inside the user's subroutine"
    else if (code >= 128) then
      words = "the user's subroutine was ended by signal "//to_text(code - 128)
    else if (code == exit_files) then
      words = "the system refused memory (see above)"
    else
      words = "the user's subroutine ended it (reported above)"
    end if
    words = words//"; the rows up to there are kept"
  end function end_words

  !> Write what waits in the units that are open.
  subroutine flush_units()
    integer, parameter :: last = 200   ! NEWUNIT gives negative numbers, which are not searched
    integer :: unit
    logical :: is_open

    do unit = 0, last
      inquire (unit=unit, opened=is_open)
      if (is_open) flush (unit)
    end do
  end subroutine flush_units

end module material_run
