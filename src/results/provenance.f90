!> Where a result comes from: program, machine, command and deck.
module provenance
  use, intrinsic :: iso_fortran_env, only: compiler_options, compiler_version
  use, intrinsic :: iso_c_binding, only: c_int, c_long
  use text, only: to_text
  implicit none
  private

  public :: provenance_t, provenance_lines, host_cores, timestamp, compiler_name, compiler_flags
  public :: text_or_empty

  !> What the head of every log begins with.
  character(*), parameter, public :: log_mark = "igaform "

  !> What the caller knows; parts that are not allocated count as empty.
  type :: provenance_t
    character(:), allocatable :: version        !! of the program
    character(:), allocatable :: git_commit
    character(:), allocatable :: build_flags    !! empty: those this layer was compiled with
    character(:), allocatable :: build          !! lines of `fingerprint`
    character(:), allocatable :: command_line
    character(:), allocatable :: identity       !! digest of deck and program; empty: not known
    character(:), allocatable :: deck_file
    character(:), allocatable :: deck_text
    character(:), allocatable :: heading
    character(:), allocatable :: units          !! the deck's label
    integer :: n_threads = 1
  end type provenance_t

  integer(c_int), parameter :: processors_online = 84   ! _SC_NPROCESSORS_ONLN of Linux

  interface
    integer(c_long) function c_sysconf(name) bind(C, name="sysconf")
      import :: c_int, c_long
      integer(c_int), value :: name
    end function c_sysconf
  end interface

contains

  !> The head of a log: version, compiler, threads, command and deck, one a line.
  function provenance_lines(source) result(lines)
    type(provenance_t), intent(in) :: source
    character(:), allocatable :: lines   !! separated by new_line
    character(1), parameter :: feed = new_line("a")

    lines = log_mark//text_or_empty(source%version)
    if (len(text_or_empty(source%git_commit)) > 0) then
      lines = lines//" ("//source%git_commit//")"
    end if
    lines = lines//feed//"compiler   "//compiler_name() &
            //feed//"threads    "//to_text(source%n_threads)//" of "//to_text(host_cores()) &
            //" cores"//feed//"started    "//timestamp() &
            //feed//"command    "//text_or_empty(source%command_line) &
            //feed//"deck       "//text_or_empty(source%deck_file)
    if (len(text_or_empty(source%heading)) > 0) then
      lines = lines//feed//"heading    "//source%heading
    end if
  end function provenance_lines

  !> The text, or an empty one if it is not allocated.
  pure function text_or_empty(given) result(known)
    character(:), allocatable, intent(in) :: given
    character(:), allocatable :: known

    known = ""
    if (allocated(given)) known = given
  end function text_or_empty

  !> Number of processors of this machine that are in use.
  integer function host_cores()
    host_cores = int(c_sysconf(processors_online))
  end function host_cores

  !> The compiler that made this layer.
  function compiler_name() result(name)
    character(:), allocatable :: name

    name = compiler_version()
  end function compiler_name

  !> The options this layer was compiled with.
  function compiler_flags() result(flags)
    character(:), allocatable :: flags

    flags = compiler_options()
  end function compiler_flags

  !> Local time as 2026-01-31T23:59:59+0100.
  function timestamp() result(now)
    character(24) :: now
    character(8) :: date
    character(10) :: time
    character(5) :: zone

    call date_and_time(date, time, zone)
    now = date(1:4)//"-"//date(5:6)//"-"//date(7:8)//"T"//time(1:2)//":"//time(3:4)//":" &
          //time(5:6)//zone
  end function timestamp

end module provenance
