!> What compiler and linker say of the sources of users, in words that say what to do.
module build_messages
  use text, only: upper_case
  implicit none
  private

  public :: cause_of, link_message

  character(*), parameter :: utilities = "XIT, ROTSIG, SINV, SPRINC, SPRIND, VSPRINC, VSPRIND, "// &
    "STDB_ABQERR, XPLB_ABQERR, XPLB_EXIT, GETOUTDIR, GETJOBNAME, GETRANK, GETNUMCPUS and the "// &
    "same with V before them, GETNUMTHREADS, GET_THREAD_ID, MUTEXINIT, MUTEXLOCK and MUTEXUNLOCK"

contains

  !> What the compiler's words mean where the source is written for another compiler; empty where
  !! they say it themselves.
  function cause_of(messages) result(cause)
    character(*), intent(in) :: messages
    character(:), allocatable :: cause

    cause = ""
    if (index(messages, "must be compared with") > 0) then
      cause = "Intel's compiler lets .EQ. and .NE. compare logicals; the standard has .EQV. "// &
              "and .NEQV. for that"
    else if (index(messages, "must be the same type and kind") > 0) then
      cause = "Intel's compiler lets the arguments of an intrinsic function differ in kind; "// &
              "make them one, such as SIGN(1.D0, X)"
    else if (index(messages, "Cannot open module file") > 0) then
      cause = "a module is missing: give its source as a --user before this file; modules that "// &
              "came with another compiler (IFWIN, MKL ...) are not there"
    else if (index(messages, "No such file or directory") > 0) then
      cause = "an included file is missing: it is looked for next to the source"
    end if
    if (cause /= "") cause = "The cause: "//cause
  end function cause_of

  !> The routines that are nowhere, by name and with a hint; else the linker's words.
  function link_message(messages) result(message)
    character(*), intent(in) :: messages
    character(:), allocatable :: message, name, names
    character(*), parameter :: mark = "undefined reference to `"
    integer :: first, length

    names = ""
    first = index(messages, mark)
    do while (first > 0)
      length = scan(messages(first + len(mark):), "'"//new_line("a")) - 1
      name = messages(first + len(mark):first + len(mark) + max(length, 0) - 1)
      if (len(name) > 1) then
        if (name(len(name):) == "_") name = name(:len(name) - 1)
      end if
      name = upper_case(name)
      if (index(", "//names//",", ", "//name//",") == 0) names = names//", "//name
      if (names(1:1) == ",") names = names(3:)
      first = next_place(messages, mark, first + len(mark))
    end do
    if (index(messages, "recompile with -fPIC") > 0) then
      message = "an object or archive of --user cannot stand in a shared library: compile it "// &
                "with -fPIC"
    else if (index(names, "SMALOCAL") > 0 .or. index(names, "SMAINT") > 0 .or. &
             index(names, "SMAREAL") > 0) then
      message = "the user subroutine calls "//names//": the arrays that Abaqus manages "// &
                "(SMAAspUserArrays.hdr) are not provided; keep such data in SAVE arrays or a module"
    else if (names == "") then
      message = "the user subroutine cannot be linked:"//new_line("a")//messages
    else
      message = "the user subroutine calls "//names//", which no file of --user has; add the "// &
        "file with it (--user FILE --user OTHER_FILE; for LAPACK or BLAS the path of that "// &
        "library). Of the utility routines of Abaqus there are "//utilities
    end if
  end function link_message

  pure integer function next_place(text, mark, from)
    character(*), intent(in) :: text, mark
    integer, intent(in) :: from

    next_place = index(text(from:), mark)
    if (next_place > 0) next_place = next_place + from - 1
  end function next_place

end module build_messages
