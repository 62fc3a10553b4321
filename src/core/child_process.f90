!> Other programs, run without a shell: words reach them as they are, whatever they contain. And
!! rows of numbers in memory that a process shares with those that it forks: what one of them has
!! put there stays when it ends, however that may be.
module child_process
  use, intrinsic :: iso_c_binding, only: c_char, c_int, c_int64_t, c_long, c_ptr, c_loc, &
                                         c_null_char, c_null_ptr, c_f_pointer, c_intptr_t, &
                                         c_size_t, c_sizeof
  use kinds, only: wp
  use c_library, only: c_dlsym, c_exit
  use text, only: string_t
  implicit none
  private

  public :: run_program, start_program, take_ended, send_signal, insist_on_end
  public :: pause_briefly, c_text, program_missing, fork_process, has_ended, end_with_parent
  public :: end_process
  public :: shared_rows_t, new_rows, free_rows, begin_rows, add_row, end_rows
  public :: is_begun, is_ended, failure_of, warning_of, values_of

  integer, parameter :: program_missing = -1   !! code of a program that cannot be started
  !> Of Linux: SIGTERM asks a program to stop, SIGUSR1 one of this kind to save its state.
  integer(c_int), parameter, public :: stop_signal = 15, save_signal = 10
  ! Of Linux: create a file and write it anew, or behind what is there.
  integer(c_int), parameter :: to_write = 577_c_int, to_append = 1089_c_int

  !> What compilers and binary tools look at, beside the language of their messages.
  character(*), parameter :: passed_on(10) = [character(17) :: "PATH", "HOME", "TMPDIR", &
    "LD_LIBRARY_PATH", "LIBRARY_PATH", "CPATH", "COMPILER_PATH", "GCC_EXEC_PREFIX", "USER", &
    "SOURCE_DATE_EPOCH"]

  !> A text as C wants it.
  type :: c_text_t
    character(kind=c_char), allocatable :: text(:)
  end type c_text_t

  integer, parameter :: longest = 1000
  integer(c_int), parameter :: begun = 1, ended = 2

  !> What stands in front of the rows.
  type, bind(C) :: head_t
    integer(c_int) :: n = 0, stage = 0
    character(kind=c_char) :: failure(longest) = " ", warning(longest) = " "
  end type head_t

  !> Rows and what is reported of them.
  type :: shared_rows_t
    private
    type(c_ptr) :: start = c_null_ptr
    integer(c_size_t) :: n_bytes = 0
    type(head_t), pointer :: head => null()
    real(wp), pointer, contiguous :: values(:, :) => null()   ! shape (columns, rows)
  end type shared_rows_t

  interface
    integer(c_int) function c_spawn(pid, file, actions, attributes, words, environment) &
        bind(C, name="posix_spawnp")
      import :: c_char, c_int, c_ptr, c_int64_t
      integer(c_int), intent(out) :: pid
      character(kind=c_char), intent(in) :: file(*)
      integer(c_int64_t), intent(in) :: actions(*)
      type(c_ptr), value :: attributes
      type(c_ptr), intent(in) :: words(*), environment(*)
    end function c_spawn

    integer(c_int) function c_actions_init(actions) bind(C, name="posix_spawn_file_actions_init")
      import :: c_int, c_int64_t
      integer(c_int64_t), intent(inout) :: actions(*)
    end function c_actions_init

    integer(c_int) function c_actions_destroy(actions) &
        bind(C, name="posix_spawn_file_actions_destroy")
      import :: c_int, c_int64_t
      integer(c_int64_t), intent(inout) :: actions(*)
    end function c_actions_destroy

    integer(c_int) function c_add_open(actions, unit, path, flags, mode) &
        bind(C, name="posix_spawn_file_actions_addopen")
      import :: c_char, c_int, c_int64_t
      integer(c_int64_t), intent(inout) :: actions(*)
      integer(c_int), value :: unit, flags, mode
      character(kind=c_char), intent(in) :: path(*)
    end function c_add_open

    integer(c_int) function c_add_dup(actions, from, to) &
        bind(C, name="posix_spawn_file_actions_adddup2")
      import :: c_int, c_int64_t
      integer(c_int64_t), intent(inout) :: actions(*)
      integer(c_int), value :: from, to
    end function c_add_dup

    integer(c_int) function c_waitpid(pid, status, options) bind(C, name="waitpid")
      import :: c_int
      integer(c_int), value :: pid, options
      integer(c_int), intent(out) :: status
    end function c_waitpid

    integer(c_int) function c_fork() bind(C, name="fork")
      import :: c_int
    end function c_fork

    integer(c_int) function c_trait(which, value) bind(C, name="prctl")
      import :: c_int, c_long
      integer(c_int), value :: which
      integer(c_long), value :: value
    end function c_trait

    integer(c_int) function c_kill(pid, signal) bind(C, name="kill")
      import :: c_int
      integer(c_int), value :: pid, signal
    end function c_kill

    integer(c_int) function c_usleep(microseconds) bind(C, name="usleep")
      import :: c_int
      integer(c_int), value :: microseconds
    end function c_usleep

    type(c_ptr) function c_mmap(place, n_bytes, access, flags, descriptor, offset) &
        bind(C, name="mmap")
      import :: c_int, c_long, c_ptr, c_size_t
      type(c_ptr), value :: place
      integer(c_size_t), value :: n_bytes
      integer(c_int), value :: access, flags, descriptor
      integer(c_long), value :: offset
    end function c_mmap

    integer(c_int) function c_munmap(place, n_bytes) bind(C, name="munmap")
      import :: c_int, c_ptr, c_size_t
      type(c_ptr), value :: place
      integer(c_size_t), value :: n_bytes
    end function c_munmap
  end interface

contains

  !> Run a program that is found along PATH and wait for its end. It reads nothing, and what it
  !! writes goes to a file. `code` is its exit code, 128 + signal where it was killed, or
  !! `program_missing`.
  subroutine run_program(words, output, code)
    type(string_t), intent(in) :: words(:)   !! the program and its arguments
    character(*), intent(in) :: output       !! path of the file for its output and its errors
    integer, intent(out) :: code
    type(c_text_t), allocatable, target :: settings(:)
    type(c_ptr) :: setting_list(size(passed_on) + 2)
    integer(c_int) :: pid, status

    code = program_missing
    call list_settings(settings, setting_list)
    call spawn(words(1)%value, words, output, to_write, setting_list, pid)
    if (pid == 0) return
    if (c_waitpid(pid, status, 0_c_int) == pid) code = exit_code(status)
  end subroutine run_program

  !> Start a program and do not wait for it. It has the environment of this one, and what it writes
  !! is added to the file's end. `process` is its number, 0 where it cannot be started.
  subroutine start_program(program, words, output, process)
    character(*), intent(in) :: program      !! its file
    type(string_t), intent(in) :: words(:)   !! how it is called, and its arguments
    character(*), intent(in) :: output       !! path of the file for its output and its errors
    integer, intent(out) :: process
    type(c_ptr), pointer :: environ, settings(:)
    integer(c_int) :: pid

    ! Declared with bind(C) it would be a variable of this program for some compilers.
    call c_f_pointer(c_dlsym(c_null_ptr, "environ"//c_null_char), environ)
    call c_f_pointer(environ, settings, [1])
    call spawn(program, words, output, to_append, settings, pid)
    process = int(pid)
  end subroutine start_program

  !> A started program that has ended meanwhile, with its exit code as `run_program` has it; process
  !! 0 if there is none.
  subroutine take_ended(process, code)
    integer, intent(out) :: process, code
    integer(c_int), parameter :: any_child = -1_c_int, no_wait = 1_c_int
    integer(c_int) :: status

    process = max(0, int(c_waitpid(any_child, status, no_wait)))
    code = program_missing
    if (process > 0) code = exit_code(status)
  end subroutine take_ended

  !> A copy of this process, which goes on from here as well: 0 in the copy, its number in this one,
  !! below zero if there is none. Units with something to write are to be flushed before. The copy
  !! has one thread.
  integer function fork_process()
    fork_process = int(c_fork())
  end function fork_process

  !> Has a copy ended, or is there none? Its exit code is as `run_program` has it.
  logical function has_ended(process, code)
    integer, intent(in) :: process
    integer, intent(out) :: code
    integer(c_int), parameter :: no_wait = 1_c_int
    integer(c_int) :: found, status

    code = program_missing
    found = c_waitpid(int(process, c_int), status, no_wait)
    if (found == process) code = exit_code(status)
    has_ended = found /= 0
  end function has_ended

  !> In a copy: end at once when the process that made it ends.
  subroutine end_with_parent()
    integer(c_int), parameter :: signal_of_parents_end = 1_c_int   ! of Linux
    integer(c_long), parameter :: kill = 9_c_long
    integer(c_int) :: ignored

    ignored = c_trait(signal_of_parents_end, kill)
  end subroutine end_with_parent

  !> End a copy that has done its work.
  subroutine end_process()
    call c_exit(0_c_int)
  end subroutine end_process

  !> Send a signal to a started program.
  subroutine send_signal(process, signal)
    integer, intent(in) :: process
    integer(c_int), intent(in) :: signal
    integer(c_int) :: ignored

    ignored = c_kill(int(process, c_int), signal)
  end subroutine send_signal

  !> Ask a program to stop that was asked before, once more; in the end kill it. To be called at
  !! every look at it, with `pause_briefly` between them.
  subroutine insist_on_end(process, n_asked)
    integer, intent(in) :: process
    integer, intent(inout) :: n_asked          !! calls up to now
    integer, parameter :: most = 100           ! for five seconds
    integer(c_int), parameter :: kill = 9_c_int

    n_asked = n_asked + 1
    call send_signal(process, stop_signal)
    if (n_asked > most) call send_signal(process, kill)
  end subroutine insist_on_end

  !> Sleep for a twentieth of a second, or up to the next signal.
  subroutine pause_briefly()
    integer(c_int) :: ignored

    ignored = c_usleep(50000_c_int)
  end subroutine pause_briefly

  !> Start a program that reads nothing and writes to a file; pid 0 if it cannot be started.
  subroutine spawn(program, words, output, how, environment, pid)
    character(*), intent(in) :: program, output
    integer(c_int), intent(in) :: how      !! `to_write` or `to_append`
    type(string_t), intent(in) :: words(:)
    type(c_ptr), intent(in) :: environment(*)
    integer(c_int), intent(out) :: pid
    integer(c_int), parameter :: to_read = 0_c_int, mode = 420_c_int
    integer(c_int64_t) :: actions(64)        ! room enough for the type that C hides
    type(c_text_t), allocatable, target :: arguments(:)
    type(c_ptr) :: argument_list(size(words) + 1)
    integer(c_int) :: failed
    integer :: i

    pid = 0
    allocate (arguments(size(words)))
    do i = 1, size(words)
      arguments(i)%text = c_text(words(i)%value)
      argument_list(i) = c_loc(arguments(i)%text)
    end do
    argument_list(size(words) + 1) = c_null_ptr
    actions = 0_c_int64_t
    if (c_actions_init(actions) /= 0) return
    failed = c_add_open(actions, 0_c_int, c_text("/dev/null"), to_read, mode)
    if (failed == 0) failed = c_add_open(actions, 1_c_int, c_text(output), how, mode)
    if (failed == 0) failed = c_add_dup(actions, 1_c_int, 2_c_int)
    if (failed == 0) failed = c_spawn(pid, c_text(program), actions, c_null_ptr, argument_list, &
                                      environment)
    if (failed /= 0) pid = 0
    failed = c_actions_destroy(actions)
  end subroutine spawn

  !> Exit code of a program that has ended, or 128 + signal.
  pure integer function exit_code(status) result(code)
    integer(c_int), intent(in) :: status

    code = iand(ishft(int(status), -8), 255)
    if (iand(int(status), 127) /= 0) code = 128 + iand(int(status), 127)
  end function exit_code

  !> The environment of the program: messages in English, the rest as it is here.
  subroutine list_settings(settings, list)
    type(c_text_t), allocatable, target, intent(inout) :: settings(:)
    type(c_ptr), intent(out) :: list(:)
    character(:), allocatable :: value
    integer :: i, n, length, status

    allocate (settings(size(passed_on) + 1))
    settings(1)%text = c_text("LC_ALL=C")
    n = 1
    do i = 1, size(passed_on)
      call get_environment_variable(trim(passed_on(i)), length=length, status=status)
      if (status /= 0) cycle
      allocate (character(length) :: value)
      call get_environment_variable(trim(passed_on(i)), value=value)
      n = n + 1
      settings(n)%text = c_text(trim(passed_on(i))//"="//value)
      deallocate (value)
    end do
    list = c_null_ptr
    do i = 1, n
      list(i) = c_loc(settings(i)%text)
    end do
  end subroutine list_settings

  !> A text with the zero that ends it in C.
  pure function c_text(given) result(text)
    character(*), intent(in) :: given
    character(kind=c_char), allocatable :: text(:)

    text = transfer(given//c_null_char, [c_null_char])
  end function c_text

  !> Room for rows; false if there is no memory.
  logical function new_rows(rows, n_columns, n_most) result(is_done)
    type(shared_rows_t), intent(out) :: rows
    integer, intent(in) :: n_columns, n_most   !! numbers in a row; rows
    integer(c_int), parameter :: to_read_and_write = 3
    integer(c_int), parameter :: shared_without_file = 33   ! MAP_SHARED + MAP_ANONYMOUS of Linux
    integer(c_int), parameter :: no_file = -1
    integer(c_size_t), parameter :: line = 64
    integer(c_size_t) :: n_head
    integer(c_intptr_t) :: address
    type(c_ptr) :: place
    type(head_t) :: empty

    n_head = iand(c_sizeof(empty) + line - 1, not(line - 1))   ! up to the next whole line
    rows%n_bytes = n_head + 8_c_size_t*n_columns*n_most
    place = c_mmap(c_null_ptr, rows%n_bytes, to_read_and_write, shared_without_file, no_file, &
                   0_c_long)
    address = transfer(place, address)
    is_done = address /= -1_c_intptr_t         ! MAP_FAILED
    if (.not. is_done) return
    rows%start = place
    call c_f_pointer(place, rows%head)
    rows%head = empty
    call c_f_pointer(transfer(address + n_head, place), rows%values, [n_columns, n_most])
  end function new_rows

  !> Give the room back.
  subroutine free_rows(rows)
    type(shared_rows_t), intent(inout) :: rows
    integer(c_int) :: ignored

    if (associated(rows%head)) ignored = c_munmap(rows%start, rows%n_bytes)
    rows = shared_rows_t()
  end subroutine free_rows

  !> Whoever adds the rows begins.
  subroutine begin_rows(rows)
    type(shared_rows_t), intent(inout) :: rows

    rows%head%stage = begun
  end subroutine begin_rows

  !> Add a row; it counts only when all of it is there.
  subroutine add_row(rows, values)
    type(shared_rows_t), intent(inout) :: rows
    real(wp), intent(in) :: values(:)

    rows%values(:, rows%head%n + 1) = values
    rows%head%n = rows%head%n + 1
  end subroutine add_row

  !> All is done; the texts are empty where there is nothing to report.
  subroutine end_rows(rows, failure, warning)
    type(shared_rows_t), intent(inout) :: rows
    character(*), intent(in) :: failure, warning
    character(longest) :: words(2)

    words = [character(longest) :: failure, warning]
    rows%head%failure = transfer(words(1), rows%head%failure)
    rows%head%warning = transfer(words(2), rows%head%warning)
    rows%head%stage = ended
  end subroutine end_rows

  !> Has somebody begun to add rows?
  logical function is_begun(rows)
    type(shared_rows_t), intent(in) :: rows

    is_begun = rows%head%stage >= begun
  end function is_begun

  !> Was the end reported?
  logical function is_ended(rows)
    type(shared_rows_t), intent(in) :: rows

    is_ended = rows%head%stage == ended
  end function is_ended

  !> Why it failed, empty if it did not.
  function failure_of(rows) result(text)
    type(shared_rows_t), intent(in) :: rows
    character(:), allocatable :: text

    text = trim(transfer(rows%head%failure, repeat(" ", longest)))
  end function failure_of

  !> What it warned of, empty for nothing.
  function warning_of(rows) result(text)
    type(shared_rows_t), intent(in) :: rows
    character(:), allocatable :: text

    text = trim(transfer(rows%head%warning, repeat(" ", longest)))
  end function warning_of

  !> The rows that are there, shape (columns, rows).
  function values_of(rows) result(values)
    type(shared_rows_t), intent(in) :: rows
    real(wp), allocatable :: values(:, :)

    values = rows%values(:, :rows%head%n)
  end function values_of

end module child_process
