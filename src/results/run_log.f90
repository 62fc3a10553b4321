!> The log of a run: plain text for people, in a file and on the terminal.
module run_log
  use, intrinsic :: iso_fortran_env, only: error_unit, int64, output_unit
  use, intrinsic :: iso_c_binding, only: c_int
  use kinds, only: wp
  use failure, only: error_t, fail
  use system_files, only: bytes_on_disk
  use timer, only: timer_t, watch_seconds, n_watches
  use text, only: string_t, to_text, counted
  implicit none
  private

  public :: run_log_t, timings_t, progress_t, open_log, silence_log, mute_log, is_muted, close_log
  public :: log_line, log_lines
  public :: log_progress, log_timings, ns_per_element_step

  !> What a run cost. The stopwatches must not overlap: they are the effects of the step.
  type :: timings_t
    type(timer_t) :: timer
    integer :: n_elements = 0
    integer :: n_threads = 1
    integer(int64) :: n_steps = 0
    real(wp) :: wall_seconds = 0.0_wp    !! of all steps together
  end type timings_t

  !> Where a run is.
  type :: progress_t
    integer(int64) :: n_increments = 0
    real(wp) :: time = 0.0_wp, dt = 0.0_wp   !! [time]
    real(wp) :: energy_error = 0.0_wp
    integer :: step = 1, n_steps = 1         !! of the deck
    character(:), allocatable :: name        !! of the step; not allocated in a deck without *STEP
    logical :: is_of_step = .false.          !! what follows is of the step, else of the run
    real(wp) :: fraction = -1.0_wp           !! done; negative: unknown
    real(wp) :: seconds_left = -1.0_wp       !! by the wall clock; negative: unknown
  end type progress_t

  !> An open log.
  type :: run_log_t
    private
    integer :: unit = -1
    character(:), allocatable :: path
    integer(int64) :: n_bytes = -1       ! that the file should have; negative: no plain file
    logical :: is_quiet = .false.        ! nothing on standard output
    logical :: is_mute = .false.         ! nor anywhere else: another process has the log
    logical :: is_terminal = .false.     ! standard output shows one progress line, rewritten
    logical :: has_progress_line = .false.
    integer :: n_shown = 0               ! characters of that line
  end type run_log_t

  interface
    integer(c_int) function c_isatty(descriptor) bind(C, name="isatty")
      import :: c_int
      integer(c_int), value :: descriptor
    end function c_isatty
  end interface

contains

  !> Create the log file; its lines also go to standard output unless `is_quiet`.
  subroutine open_log(log, path, is_quiet, error, is_going_on)
    type(run_log_t), intent(out) :: log
    character(*), intent(in) :: path
    logical, intent(in) :: is_quiet
    type(error_t), allocatable, intent(out) :: error
    logical, intent(in), optional :: is_going_on   !! add to a log that is there
    integer :: status
    character(256) :: message
    logical :: is_added

    is_added = .false.
    if (present(is_going_on)) is_added = is_going_on
    open (newunit=log%unit, file=path, action="write", iostat=status, iomsg=message, &
          status=merge("unknown", "replace", is_added), &
          position=merge("append", "asis  ", is_added))
    if (status /= 0) then
      call fail(error, "log file '"//path//"': "//trim(message))
      log%unit = -1
    end if
    log%is_quiet = is_quiet
    log%path = path
    if (log%unit /= -1) log%n_bytes = bytes_on_disk(path)
    log%is_terminal = c_isatty(1_c_int) == 1
  end subroutine open_log

  !> Write nothing to standard output any more.
  subroutine silence_log(log)
    type(run_log_t), intent(inout) :: log

    log%is_quiet = .true.
    log%has_progress_line = .false.
  end subroutine silence_log

  !> Write nothing anywhere: the log is that of another process.
  subroutine mute_log(log)
    type(run_log_t), intent(inout) :: log

    log%is_mute = .true.
  end subroutine mute_log

  !> Is the log that of another process?
  pure logical function is_muted(log)
    type(run_log_t), intent(in) :: log

    is_muted = log%is_mute
  end function is_muted

  !> Close the log file.
  subroutine close_log(log)
    type(run_log_t), intent(inout) :: log

    call end_progress_line(log)
    if (log%unit /= -1) close (log%unit)
    log%unit = -1
  end subroutine close_log

  !> Write a line, which may contain line feeds. One that begins with `warning: ` goes to standard
  !! error instead of standard output, of a quiet run too.
  subroutine log_line(log, line)
    type(run_log_t), intent(inout) :: log
    character(*), intent(in) :: line

    if (log%is_mute) return
    call end_progress_line(log)
    if (index(line, "warning: ") == 1) then
      write (error_unit, "(a)") "igaform: "//line
    else if (.not. log%is_quiet) then
      write (output_unit, "(a)") line
    end if
    call write_to_file(log, line)
  end subroutine log_line

  !> Write several lines.
  subroutine log_lines(log, lines)
    type(run_log_t), intent(inout) :: log
    type(string_t), intent(in) :: lines(:)
    integer :: i

    do i = 1, size(lines)
      call log_line(log, lines(i)%value)
    end do
  end subroutine log_lines

  !> Write where the run is. On a terminal the line replaces the one before.
  subroutine log_progress(log, progress)
    type(run_log_t), intent(inout) :: log
    type(progress_t), intent(in) :: progress
    character(:), allocatable :: line

    if (log%is_mute) return
    line = progress_words(progress)
    call write_to_file(log, line)
    if (log%is_quiet) return
    if (log%is_terminal) then
      write (output_unit, "(a, a)", advance="no") achar(13), &
        line//repeat(" ", max(0, log%n_shown - len(line)))
      log%has_progress_line = .true.
      log%n_shown = len(line)
    else
      write (output_unit, "(a)") line
    end if
    flush (output_unit)
  end subroutine log_progress

  !> `left 8s  step 1 of 2 draw` at the end of the line is of the run, `left 8s in step 1 of 2 draw`
  !! and the percentage then are of the step.
  function progress_words(progress) result(words)
    type(progress_t), intent(in) :: progress
    character(:), allocatable :: words
    character(120) :: line
    character(5) :: percentage

    percentage = "   --"
    if (progress%fraction >= 0.0_wp) write (percentage, "(f5.1)") 100*progress%fraction
    write (line, "(a, i10, a, es11.4, a, es10.3, a, es10.2)") "step", progress%n_increments, &
      "  time", progress%time, " ("//percentage//" %)  dt", progress%dt, "  energy error", &
      progress%energy_error
    words = trim(line)
    if (progress%seconds_left >= 0.0_wp) words = words//"  left "//duration(progress%seconds_left)
    if (.not. allocated(progress%name)) return
    if (.not. (progress%is_of_step .and. progress%seconds_left >= 0.0_wp)) words = words//" "
    if (progress%is_of_step) words = words//" in"
    words = words//" step "//to_text(progress%step)//" of "//to_text(progress%n_steps)//" "// &
            progress%name
  end function progress_words

  !> Write the cost of the run: seconds, percentage and calls of each effect, then the whole.
  subroutine log_timings(log, timings)
    type(run_log_t), intent(inout) :: log
    type(timings_t), intent(in) :: timings
    real(wp) :: seconds, measured
    character(100) :: line
    integer :: i

    call log_line(log, "effect                                seconds   share %         calls")
    measured = 0.0_wp
    do i = 1, n_watches(timings%timer)
      seconds = watch_seconds(timings%timer, i)
      measured = measured + seconds
      write (line, "(a32, f13.3, f10.1, i14)") timings%timer%watches(i)%name//repeat(" ", 32), &
        seconds, percent(seconds, timings%wall_seconds), timings%timer%watches(i)%n_calls
      call log_line(log, trim(line))
    end do
    seconds = timings%wall_seconds - measured
    write (line, "(a32, f13.3, f10.1)") "other"//repeat(" ", 32), seconds, &
      percent(seconds, timings%wall_seconds)
    call log_line(log, trim(line))
    write (line, "(a32, f13.3, f10.1, i14)") "all steps"//repeat(" ", 32), timings%wall_seconds, &
      100.0_wp, timings%n_steps
    call log_line(log, trim(line))
    write (line, "(a, f0.1, a)") counted(timings%n_elements, "element")//", "// &
      counted(timings%n_steps, "step")//", "//counted(timings%n_threads, "thread")//": ", &
      ns_per_element_step(timings), " ns per element and step"
    call log_line(log, trim(line))
  end subroutine log_timings

  !> Wall clock per element and step [ns].
  pure real(wp) function ns_per_element_step(timings) result(ns)
    type(timings_t), intent(in) :: timings

    ns = 1.0e9_wp*timings%wall_seconds/max(real(timings%n_elements, wp)*timings%n_steps, 1.0_wp)
  end function ns_per_element_step

  pure real(wp) function percent(part, whole)
    real(wp), intent(in) :: part, whole

    percent = 100*part/max(whole, tiny(1.0_wp))
  end function percent

  ! Seconds as 1h02m03s, without leading parts that are zero.
  pure function duration(seconds) result(words)
    real(wp), intent(in) :: seconds
    character(:), allocatable :: words
    integer :: s
    character(16) :: buffer

    s = nint(min(seconds, 3.5e6_wp))
    if (s >= 3600) then
      write (buffer, "(i0, a, i2.2, a, i2.2, a)") s/3600, "h", mod(s, 3600)/60, "m", mod(s, 60), "s"
    else if (s >= 60) then
      write (buffer, "(i0, a, i2.2, a)") s/60, "m", mod(s, 60), "s"
    else
      write (buffer, "(i0, a)") s, "s"
    end if
    words = trim(buffer)
  end function duration

  subroutine end_progress_line(log)
    type(run_log_t), intent(inout) :: log

    if (log%has_progress_line) write (output_unit, "(a)") ""
    log%has_progress_line = .false.
  end subroutine end_progress_line

  !> A line to the file. Where it does not come to the disk a warning says so, once. WRITE and FLUSH
  !! of gfortran keep that to themselves, so the size of the file decides.
  subroutine write_to_file(log, line)
    type(run_log_t), intent(inout) :: log
    character(*), intent(in) :: line
    integer :: status

    if (log%unit == -1) return
    write (log%unit, "(a)", iostat=status) line
    flush (log%unit, iostat=status)
    if (log%n_bytes < 0) return
    log%n_bytes = log%n_bytes + len(line) + 1
    if (bytes_on_disk(log%path) >= log%n_bytes) return
    write (error_unit, "(a)") "igaform: warning: log file: lines of it cannot be written; is "// &
      "the disk full? The run continues"
    log%n_bytes = -1
  end subroutine write_to_file

end module run_log
