!> Small services for text: case, numbers to and from text, the nearest of several names.
module text
  use, intrinsic :: ieee_arithmetic, only: ieee_is_finite
  use, intrinsic :: iso_fortran_env, only: int64
  use kinds, only: wp
  implicit none
  private

  public :: string_t, upper_case, lower_case, squeezed, to_text, rounded_text, place_text
  public :: read_real, read_integer, edit_distance, nearest_name, strings, append_text, joined
  public :: counted

  character(1), parameter, public :: axis_names(3) = ["x", "y", "z"]

  !> Text of its own length, for lists of texts.
  type :: string_t
    character(:), allocatable :: value
  end type string_t

  !> A number as the shortest text that reads back as the same number.
  interface to_text
    module procedure integer_to_text, long_to_text, real_to_text
  end interface to_text

  !> A count with its noun in the singular or plural, such as `1 layer` or `2 layers`.
  interface counted
    module procedure counted_integers, counted_longs
  end interface counted

contains

  !> The text with its letters a to z in upper case.
  pure function upper_case(given) result(upper)
    character(*), intent(in) :: given
    character(len(given)) :: upper

    upper = with_letters(given, "a", -32)
  end function upper_case

  !> The text with its letters A to Z in lower case.
  pure function lower_case(given) result(lower)
    character(*), intent(in) :: given
    character(len(given)) :: lower

    lower = with_letters(given, "A", 32)
  end function lower_case

  !> The text with the 26 letters from the first on moved in the ASCII table.
  pure function with_letters(given, first, shift) result(new)
    character(*), intent(in) :: given
    character(1), intent(in) :: first
    integer, intent(in) :: shift
    character(len(given)) :: new
    integer :: i, code

    new = given
    do i = 1, len(given)
      code = iachar(given(i:i))
      if (code >= iachar(first) .and. code < iachar(first) + 26) new(i:i) = achar(code + shift)
    end do
  end function with_letters

  !> The text without blanks at its ends, and with single blanks inside.
  pure function squeezed(given) result(short)
    character(*), intent(in) :: given
    character(:), allocatable :: short
    character(len(given)) :: buffer
    integer :: i, n

    n = 0
    do i = 1, len(given)
      if (given(i:i) == " ") then
        if (n == 0) cycle
        if (buffer(n:n) == " ") cycle
      end if
      n = n + 1
      buffer(n:n) = given(i:i)
    end do
    short = trim(buffer(:n))
  end function squeezed

  pure function integer_to_text(number) result(written)
    integer, intent(in) :: number
    character(:), allocatable :: written

    written = long_to_text(int(number, int64))
  end function integer_to_text

  pure function counted_integers(n, noun, nouns) result(words)
    integer, intent(in) :: n
    character(*), intent(in) :: noun               !! for one
    character(*), intent(in), optional :: nouns    !! for several; else the noun with an s
    character(:), allocatable :: words

    words = counted_longs(int(n, int64), noun, nouns)
  end function counted_integers

  pure function counted_longs(n, noun, nouns) result(words)
    integer(int64), intent(in) :: n
    character(*), intent(in) :: noun
    character(*), intent(in), optional :: nouns
    character(:), allocatable :: words

    words = noun
    if (n /= 1) words = noun//"s"
    if (n /= 1 .and. present(nouns)) words = nouns
    words = to_text(n)//" "//words
  end function counted_longs

  pure function long_to_text(number) result(written)
    integer(int64), intent(in) :: number
    character(:), allocatable :: written
    character(20) :: buffer

    write (buffer, "(i0)") number
    written = trim(buffer)
  end function long_to_text

  !> Fifteen digits suffice for any number a person wrote; the rest takes up to seventeen.
  pure function real_to_text(number) result(written)
    real(wp), intent(in) :: number
    character(:), allocatable :: written
    character(32) :: buffer
    character(12) :: form
    real(wp) :: back
    integer :: digits, status

    if (.not. ieee_is_finite(number)) then
      write (buffer, "(g0)") number
      written = trim(adjustl(buffer))
      return
    else if (abs(number) < 1.0e9_wp .and. abs(number - nint(number)) <= 0.0_wp) then
      written = integer_to_text(nint(number))
      return
    end if
    do digits = 14, 16
      write (form, "('(es30.',i0,'e3)')") digits
      write (buffer, form) number
      ! The largest numbers, rounded up, are too large to be read.
      read (buffer, *, iostat=status) back
      if (status /= 0) cycle
      if (abs(back - number) <= 0.0_wp) exit
    end do
    written = positional(trim(adjustl(buffer)))
  end function real_to_text

  !> A number to four digits, as short as it can be: 5, 36.92, 12000, 7.85e-9.
  pure function rounded_text(number) result(written)
    real(wp), intent(in) :: number
    character(:), allocatable :: written
    character(12) :: buffer

    write (buffer, "(es12.3e3)") number
    written = trim(adjustl(buffer))
    if (ieee_is_finite(number)) written = positional(written)
  end function rounded_text

  !> Coordinates to four digits, such as (1, 2.5, 0).
  pure function place_text(x) result(written)
    real(wp), intent(in) :: x(3)
    character(:), allocatable :: written
    real(wp), parameter :: round_off = 1.0e-12_wp   ! of the largest
    real(wp) :: clean(3)

    clean = merge(x, 0.0_wp, abs(x) > round_off*maxval(abs(x)))
    written = "("//rounded_text(clean(1))//", "//rounded_text(clean(2))//", "// &
              rounded_text(clean(3))//")"
  end function place_text

  !> The number in the shortest form: without an exponent where that stays short.
  pure function positional(scientific) result(written)
    character(*), intent(in) :: scientific   !! sign, one digit, a point, more digits, E, exponent
    character(:), allocatable :: written, sign, digits
    integer, parameter :: most_zeros = 5     ! places of a whole number that ends in zeros
    integer :: point, last, exponent

    sign = ""
    if (scientific(1:1) == "-") sign = "-"
    point = index(scientific, ".")
    last = index(scientific, "E") - 1
    read (scientific(last + 2:), *) exponent
    digits = scientific(point - 1:point - 1)//scientific(point + 1:last)
    digits = digits(:max(1, verify(digits, "0", back=.true.)))
    if (digits == "0") sign = ""
    if (exponent >= 0 .and. exponent < most_zeros) &
      digits = digits//repeat("0", max(0, exponent + 1 - len(digits)))
    if (exponent >= 0 .and. exponent < most_zeros .and. len(digits) == exponent + 1) then
      written = sign//digits
    else if (exponent >= 0 .and. exponent < 9 .and. len(digits) > exponent + 1) then
      written = sign//digits(:exponent + 1)//"."//digits(exponent + 2:)
    else if (exponent < 0 .and. exponent > -4) then
      written = sign//"0."//repeat("0", -exponent - 1)//digits
    else
      written = sign//digits(1:1)
      if (len(digits) > 1) written = written//"."//digits(2:)
      written = written//"e"//integer_to_text(exponent)
    end if
  end function positional

  !> Read a number such as 12, -0.5, .5, 1.e-3 or 1.5d0; all of the text must belong to it.
  pure subroutine read_real(given, number, is_number)
    character(*), intent(in) :: given
    real(wp), intent(out) :: number
    logical, intent(out) :: is_number
    integer :: status

    number = 0.0_wp
    is_number = has_number_form(given)
    if (.not. is_number) return
    read (given, "(f200.0)", iostat=status) number
    is_number = status == 0
    if (is_number) is_number = ieee_is_finite(number)
  end subroutine read_real

  !> Read a whole number; all of the text must belong to it.
  pure subroutine read_integer(given, number, is_number)
    character(*), intent(in) :: given
    integer, intent(out) :: number
    logical, intent(out) :: is_number
    integer :: first, status

    number = 0
    first = 1
    is_number = len(given) > 0 .and. len(given) < 200
    if (.not. is_number) return
    if (scan(given(1:1), "+-") > 0) first = 2
    is_number = first <= len(given) .and. verify(given(first:), "0123456789") == 0
    if (.not. is_number) return
    read (given, "(i200)", iostat=status) number
    is_number = status == 0
  end subroutine read_integer

  !> Sign, digits with at most one point, and an exponent that has digits too.
  pure logical function has_number_form(given)
    character(*), intent(in) :: given
    integer :: i, n_digits

    has_number_form = .false.
    if (len(given) == 0 .or. len(given) > 199) return
    i = 1 + min(1, scan(given(1:1), "+-"))
    n_digits = leading_digits(given(i:))
    i = i + n_digits
    if (i <= len(given)) then
      if (given(i:i) == ".") then
        n_digits = n_digits + leading_digits(given(i + 1:))
        i = i + 1 + leading_digits(given(i + 1:))
      end if
    end if
    if (n_digits == 0) return
    if (i <= len(given)) then
      if (scan(given(i:i), "eEdD") == 0) return
      i = i + 1
      if (i <= len(given)) i = i + min(1, scan(given(i:i), "+-"))
      n_digits = leading_digits(given(i:))
      if (n_digits == 0) return
      i = i + n_digits
    end if
    has_number_form = i > len(given)
  end function has_number_form

  pure integer function leading_digits(given)
    character(*), intent(in) :: given

    leading_digits = verify(given, "0123456789") - 1
    if (leading_digits < 0) leading_digits = len(given)
  end function leading_digits

  !> Least number of letters to insert, delete or exchange that makes one text the other.
  !! Source: R. A. Wagner and M. J. Fischer, J. ACM 21 (1974).
  pure integer function edit_distance(a, b)
    character(*), intent(in) :: a, b
    integer :: row(0:len(b)), i, j, diagonal, above

    row = [(j, j=0, len(b))]
    do i = 1, len(a)
      diagonal = row(0)
      row(0) = i
      do j = 1, len(b)
        above = row(j)
        row(j) = min(above + 1, row(j - 1) + 1, diagonal + merge(0, 1, a(i:i) == b(j:j)))
        diagonal = above
      end do
    end do
    edit_distance = row(len(b))
  end function edit_distance

  !> The name most like `given`, whatever its case; empty where none is at least half alike.
  pure function nearest_name(given, names) result(nearest)
    character(*), intent(in) :: given
    type(string_t), intent(in) :: names(:)
    character(:), allocatable :: nearest
    integer, parameter :: longest = 80   ! a longer text is no misspelt name
    integer :: i, distance, least

    nearest = ""
    if (len(given) > longest) return
    least = huge(least)
    do i = 1, size(names)
      if (len(names(i)%value) > longest) cycle
      distance = edit_distance(upper_case(given), upper_case(names(i)%value))
      if (distance >= least) cycle
      least = distance
      nearest = names(i)%value
    end do
    if (least > max(len(given), len(nearest))/2) nearest = ""
  end function nearest_name

  !> Texts of one common length as a list of trimmed texts.
  pure function strings(padded) result(list)
    character(*), intent(in) :: padded(:)
    type(string_t), allocatable :: list(:)
    integer :: i

    allocate (list(size(padded)))
    do i = 1, size(padded)
      list(i)%value = trim(padded(i))
    end do
  end function strings

  !> One more text at the end of a list.
  pure subroutine append_text(list, words)
    type(string_t), allocatable, intent(inout) :: list(:)
    character(*), intent(in) :: words
    type(string_t) :: last

    last%value = words
    list = [list, last]
  end subroutine append_text

  !> The texts one after the other with a separator between them.
  pure function joined(list, separator) result(line)
    type(string_t), intent(in) :: list(:)
    character(*), intent(in) :: separator
    character(:), allocatable :: line
    integer :: i

    line = ""
    do i = 1, size(list)
      if (i > 1) line = line//separator
      line = line//list(i)%value
    end do
  end function joined

end module text
