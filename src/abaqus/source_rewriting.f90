!> What other compilers accept and gfortran does not, rewritten in a copy of a source file: line
!! by line, so that messages name the lines of the file itself.
module source_rewriting
  use text, only: lower_case
  use text_file, only: read_whole_file, take_line
  use user_sources, only: write_text
  implicit none
  private

  public :: rewrite_source

  !> Modules of Intel's compiler whose procedures gfortran has built in.
  character(8), parameter :: left_out(4) = [character(8) :: "ifport", "iflport", "ifposix", &
    "ifcore"]

contains

  !> Write a copy in which capitals in the words of the preprocessor are small, comparisons with
  !! .TRUE. and .FALSE. are written as Fortran has them, and modules that came with another
  !! compiler are omitted. Without a need for that no file is written, and `changes` is empty.
  subroutine rewrite_source(path, target, is_fixed, changes)
    character(*), intent(in) :: path, target
    logical, intent(in) :: is_fixed
    character(:), allocatable, intent(out) :: changes   !! what was changed, for the user
    character(:), allocatable :: content, line, copy
    logical :: is_there
    integer :: first

    changes = ""
    copy = "# 1 """//path//""""//new_line("a")
    call read_whole_file(path, content, is_there)
    first = 1
    do while (first <= len(content))
      call take_line(content, first, line)
      call rewrite_line(line, is_fixed, changes)
      copy = copy//line//new_line("a")
    end do
    if (changes /= "") call write_text(target, copy)
  end subroutine rewrite_source

  subroutine rewrite_line(line, is_fixed, changes)
    character(:), allocatable, intent(inout) :: line
    logical, intent(in) :: is_fixed
    character(:), allocatable, intent(inout) :: changes
    character(:), allocatable :: before

    if (len(line) == 0) return
    if (line(1:1) == "#") then
      before = line
      call rewrite_directive(line)
      if (line /= before) call note("words of the preprocessor in small letters", changes)
      return
    end if
    if (is_fixed .and. scan(line(1:1), "Cc*!") > 0) return
    if (uses_left_out(line)) then
      line = "!"//line
      call note("USE of a module of another compiler left out", changes)
      return
    end if
    before = line
    call rewrite_comparisons(line)
    if (line /= before) call note("comparisons with .TRUE. and .FALSE. as the standard has them", &
                                  changes)
  end subroutine rewrite_line

  !> The word of a directive and DEFINED in its condition in lower case; names of macros and files
  !! stay as they are.
  pure subroutine rewrite_directive(line)
    character(*), intent(inout) :: line
    character(*), parameter :: word = "DEFINED", of_name = "abcdefghijklmnopqrstuvwxyz0123456789_"
    character(:), allocatable :: padded
    integer :: first, last, i

    first = verify(line(2:)//"x", " "//achar(9)) + 1
    last = first + scan(line(first:)//" ", " (<""!"//achar(9)//achar(13)) - 2
    line(first:last) = lower_case(line(first:last))
    if (.not. any(line(first:last) == [character(4) :: "if", "elif"])) return
    padded = lower_case(line)//" "
    do i = last + 2, len(line) - len(word) + 1
      if (line(i:i + len(word) - 1) /= word) cycle
      if (scan(padded(i - 1:i - 1)//padded(i + len(word):i + len(word)), of_name) == 0) &
        line(i:i + len(word) - 1) = lower_case(word)
    end do
  end subroutine rewrite_directive

  subroutine note(what, changes)
    character(*), intent(in) :: what
    character(:), allocatable, intent(inout) :: changes

    if (index(changes, what) > 0) return
    if (changes /= "") changes = changes//", "
    changes = changes//what
  end subroutine note

  !> Is the line all of a statement that uses a module of those?
  pure logical function uses_left_out(line)
    character(*), intent(in) :: line
    character(:), allocatable :: code
    integer :: i, n

    uses_left_out = .false.
    code = adjustl(lower_case(line))
    if (index(code, "use ") /= 1 .or. code(max(1, len_trim(code)):) == "&") return
    code = adjustl(code(5:))
    do i = 1, size(left_out)
      n = len_trim(left_out(i))
      if (index(code//" ", left_out(i)(:n)) /= 1) cycle
      uses_left_out = scan(code//" ", " ,!"//achar(13)) == n + 1
      if (uses_left_out) return
    end do
  end function uses_left_out

  !> A comparison with .TRUE. or .FALSE. becomes what it compares, with .NOT. before it where the
  !! two differ: .EQV. would bind less than .AND. does.
  subroutine rewrite_comparisons(line)
    character(:), allocatable, intent(inout) :: line
    character(4), parameter :: operators(4) = [character(4) :: ".eq.", "==", ".ne.", "/="]
    character(7), parameter :: values(2) = [character(7) :: ".true.", ".false."]
    integer :: i, k, from, place, last, first

    do i = 1, size(operators)
      from = 1
      do
        place = index(lower_case(line(from:)), trim(operators(i)))
        if (place == 0) exit
        place = from + place - 1
        from = place + 1
        if (is_in_text(line(:place - 1))) cycle
        last = place + len_trim(operators(i))
        last = last + max(0, verify(line(last:)//"x", " ") - 1)
        do k = 1, size(values)
          if (index(lower_case(line(last:)), trim(values(k))) /= 1) cycle
          first = start_of_operand(line(:place - 1))
          if (first == 0) exit
          if (i <= 2 .eqv. k == 1) then
            line = trim(line(:place - 1))//" "//line(last + len_trim(values(k)):)
          else
            line = line(:first - 1)//".NOT."//trim(line(first:place - 1))//" "// &
                   line(last + len_trim(values(k)):)
          end if
          from = 1
          exit
        end do
      end do
    end do
  end subroutine rewrite_comparisons

  !> Does the text end inside a constant or a comment?
  pure logical function is_in_text(text)
    character(*), intent(in) :: text
    character(1) :: quote
    integer :: i

    quote = ""
    do i = 1, len(text)
      if (quote == "!") exit
      if (quote == "") then
        if (scan(text(i:i), "'""!") > 0) quote = text(i:i)
      else if (text(i:i) == quote) then
        quote = ""
      end if
    end do
    is_in_text = quote /= ""
  end function is_in_text

  !> Where the name, element or bracket begins that the text ends with; 0 where that is unknown.
  pure integer function start_of_operand(text) result(first)
    character(*), intent(in) :: text
    character(*), parameter :: of_name = "abcdefghijklmnopqrstuvwxyz0123456789_$%"
    integer :: depth

    first = len_trim(text)
    if (first == 0) return
    if (text(first:first) == ")") then
      depth = 0
      do while (first > 0)
        if (text(first:first) == ")") depth = depth + 1
        if (text(first:first) == "(") depth = depth - 1
        if (depth == 0) exit
        first = first - 1
      end do
      if (first == 0) return
      first = first - 1
    else if (scan(lower_case(text(first:first)), of_name) == 0) then
      first = 0
      return
    end if
    do while (first > 0)
      if (scan(lower_case(text(first:first)), of_name) == 0) exit
      first = first - 1
    end do
    first = first + 1
  end function start_of_operand

end module source_rewriting
