!> What the bits of a result depend on beside the deck: how the program was built. Two builds of the
!! same sources round differently.
module build_fingerprint
  use system_files, only: library_of
  use provenance, only: compiler_flags, compiler_name
  implicit none
  private

  public :: fingerprint, fingerprint_difference, options_that_count

  integer, parameter :: width = 11          ! of the names in front of the lines
  integer, parameter :: most_options = 6    ! told of, of each build
  character(1), parameter :: feed = new_line("a")

contains

  !> The build of this program, a line for each property: program, compiler, its options with
  !! `-march=native` resolved, LAPACK and BLAS as loaded, instances of the kernel.
  function fingerprint(program, kernels) result(lines)
    character(*), intent(in) :: program     !! version and digest of the sources
    character(*), intent(in) :: kernels     !! tuned instances of the block kernel
    character(:), allocatable :: lines
    character(:), allocatable :: lapack, blas

    lapack = library_of("dpbtrf_")
    blas = library_of("dgemm_")
    if (blas /= lapack) lapack = lapack//" "//blas
    lines = line("program", program)//line("compiler", compiler_name()) &
            //line("options", options_that_count(compiler_flags())) &
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

end module build_fingerprint
