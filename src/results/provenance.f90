!> Where a result comes from: program, machine, command and deck; and what its bits depend on apart
!! from the deck: how the program was built. Two builds of the same sources round differently.
module provenance
  use, intrinsic :: iso_fortran_env, only: compiler_options, compiler_version, int64
  use, intrinsic :: iso_c_binding, only: c_int, c_long
  use system_files, only: library_of
  use text, only: to_text, counted
  use hdf5_file, only: create_group, hdf5_file_t, h5_int64, write_integers, write_text, &
                       write_text_attribute
  implicit none
  private

  public :: provenance_t, provenance_lines, write_provenance, write_deck, host_cores
  public :: text_or_empty, fingerprint, fingerprint_difference, options_that_count

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
    character(:), allocatable :: deck_resolved  !! the same, includes and parameters replaced
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

  integer, parameter :: width = 11          ! of the names in front of the lines of a fingerprint
  integer, parameter :: most_options = 6    ! listed of each build
  character(1), parameter :: feed = new_line("a")

contains

  !> The head of a log: version, compiler, threads, command and deck, one a line.
  function provenance_lines(source) result(lines)
    type(provenance_t), intent(in) :: source
    character(:), allocatable :: lines   !! separated by new_line

    lines = log_mark//text_or_empty(source%version)
    if (len(text_or_empty(source%git_commit)) > 0) lines = lines//" ("//source%git_commit//")"
    lines = lines//feed//"compiler   "//compiler_version() &
            //feed//"threads    "//to_text(source%n_threads)//" of "// &
            counted(host_cores(), "core")//feed//"started    "//timestamp() &
            //feed//"command    "//text_or_empty(source%command_line) &
            //feed//"deck       "//text_or_empty(source%deck_file)
    if (len(text_or_empty(source%heading)) > 0) &
      lines = lines//feed//"heading    "//source%heading
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

  !> The build of this program, a line for each property: program, compiler, its options with
  !! `-march=native` resolved, LAPACK and BLAS, instances of the kernel.
  function fingerprint(program, kernels, archives) result(lines)
    character(*), intent(in) :: program     !! version and digest of the sources
    character(*), intent(in) :: kernels     !! tuned instances of the block kernel
    character(*), intent(in), optional :: archives   !! of LAPACK and BLAS; none: those loaded
    character(:), allocatable :: lines
    character(:), allocatable :: lapack, blas

    lapack = library_of("dpbtrf_")
    blas = library_of("dgemm_")
    if (blas /= lapack) lapack = lapack//" "//blas
    if (present(archives)) then
      if (archives /= "") lapack = archives
    end if
    lines = line("program", program)//line("compiler", compiler_version()) &
            //line("options", options_that_count(compiler_options())) &
            //line("lapack", lapack)//line("kernels", kernels)
  end function fingerprint

  pure function line(name, value)
    character(*), intent(in) :: name, value
    character(:), allocatable :: line
    character(width) :: head

    head = name
    line = head//value//feed
  end function line

  !> The options of a compiler on which the bits of results may depend: those of machine,
  !! optimisation and code, but neither folders nor messages nor the sizes of caches.
  pure function options_that_count(options) result(kept)
    character(*), intent(in) :: options      !! set apart by blanks
    character(:), allocatable :: kept
    character(:), allocatable :: rest, word

    kept = ""
    rest = options
    do
      call take_word(rest, word)
      if (word == "") exit
      if (len(word) < 2) cycle
      if (.not. any(word(:2) == ["-m", "-O", "-f"])) cycle
      if (index(word, "-fdiagnostics") == 1 .or. index(word, "/") > 0) cycle
      if (word == "-fpreprocessed") cycle          ! by the generator of CMake
      if (kept /= "") kept = kept//" "
      kept = kept//word
    end do
  end function options_that_count

  !> In which lines two builds differ, with both values; empty if they are the same.
  pure function fingerprint_difference(was, now) result(words)
    character(*), intent(in) :: was, now     !! as from `fingerprint`
    character(:), allocatable :: words
    character(:), allocatable :: rest, name, then_value, now_value
    integer :: n

    words = ""
    rest = now
    do
      n = index(rest, feed)
      if (n <= width) exit
      name = rest(:width)
      now_value = rest(width + 1:n - 1)
      rest = rest(n + 1:)
      then_value = value_of(was, name)
      if (then_value == now_value) cycle
      if (words /= "") words = words//"; "
      if (name == "options") then
        words = words//trim(name)//" then "//only_in(then_value, now_value)//", now "// &
                only_in(now_value, then_value)
      else
        words = words//trim(name)//" then "//then_value//", now "//now_value
      end if
    end do
  end function fingerprint_difference

  !> The value of a line; "not known" where there is no such line.
  pure function value_of(lines, name) result(value)
    character(*), intent(in) :: lines, name
    character(:), allocatable :: value
    integer :: first, last

    value = "not known"
    first = index(feed//lines, feed//name)
    if (first == 0) return
    last = first + index(lines(first:)//feed, feed) - 2
    value = lines(first + width:last)
  end function value_of

  !> Words of the one list that the other has not, the first few; "without these" for none.
  pure function only_in(one, other) result(words)
    character(*), intent(in) :: one, other
    character(:), allocatable :: words
    character(:), allocatable :: rest, word
    integer :: n

    words = ""
    rest = one
    n = 0
    do
      call take_word(rest, word)
      if (word == "") exit
      if (index(" "//other//" ", " "//word//" ") > 0) cycle
      n = n + 1
      if (n <= most_options) words = words//" "//word
    end do
    if (n > most_options) words = words//" ..."
    if (n == 0) words = " without these"
    words = words(2:)
  end function only_in

  !> Take the first word off a text; empty where there is none left.
  pure subroutine take_word(rest, word)
    character(:), allocatable, intent(inout) :: rest
    character(:), allocatable, intent(out) :: word
    integer :: n

    rest = trim(adjustl(rest))
    n = index(rest//" ", " ")
    word = rest(:n - 1)
    rest = rest(n:)
  end subroutine take_word

  !> Write /provenance; its attribute `status` says running until the file is closed in order.
  subroutine write_provenance(file, source)
    type(hdf5_file_t), intent(inout) :: file
    type(provenance_t), intent(in) :: source
    character(*), parameter :: folder = "/provenance/"
    character(:), allocatable :: flags

    flags = text_or_empty(source%build_flags)
    if (len(flags) == 0) flags = compiler_options()
    call create_group(file, "/provenance")
    call write_text_attribute(file, "/provenance", "status", "running")
    call put(file, "version", source%version, "version of the program")
    call put(file, "git_commit", source%git_commit, "commit of the program's sources")
    call write_text(file, folder//"compiler", compiler_version(), "compiler of the program")
    call put(file, "compiler_flags", flags, "options of the compiler")
    call put(file, "build", source%build, &
             "what the bits of results depend on besides the deck, one a line")
    call put(file, "command_line", source%command_line, "command that made this file")
    call write_deck(file, source)
    call write_text(file, folder//"start_time", timestamp(), "local time at the start")
    call write_integers(file, folder//"threads", [int(source%n_threads, int64)], [integer ::], &
                        "threads of the run", h5_int64)
    call write_integers(file, folder//"host_cores", [int(host_cores(), int64)], [integer ::], &
                        "processors of the machine", h5_int64)
  end subroutine write_provenance

  !> Write the part of /provenance that the deck makes, which may be another one when a run is taken
  !! up again.
  subroutine write_deck(file, source)
    type(hdf5_file_t), intent(inout) :: file
    type(provenance_t), intent(in) :: source

    call write_text_attribute(file, "/provenance", "identity", text_or_empty(source%identity))
    call put(file, "deck_file", source%deck_file, "name of the deck")
    call put(file, "deck_text", source%deck_text, "the deck as it was read")
    call put(file, "deck_resolved", source%deck_resolved, "the deck with includes, parameters "// &
             "and defaults replaced; lists of more than 500 lines are left out")
    call put(file, "heading", source%heading, "heading of the deck")
    call put(file, "units", source%units, "units label of the deck")
  end subroutine write_deck

  subroutine put(file, name, value, description)
    type(hdf5_file_t), intent(inout) :: file
    character(*), intent(in) :: name, description
    character(:), allocatable, intent(in) :: value

    call write_text(file, "/provenance/"//name, text_or_empty(value), description)
  end subroutine put

end module provenance
