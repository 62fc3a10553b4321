!> Comparison of two lists of numbers, element by element, for the assertions.
!!
!! The first list may be a single value that all elements of the second are compared with; its shape
!! is then empty. Lists are the array elements in storage order; the shapes say what they came from.
module funit_compare
  use, intrinsic :: iso_fortran_env, only: int64, real64
  use funit_failures, only: SourceLocation, throw
  implicit none
  private

  public :: compare

  !> compare(relation, shape_a, shape_b, a, b, ...): fail unless `a relation b` holds everywhere.
  interface compare
    module procedure compare_reals, compare_integers, compare_long_integers
  end interface compare

contains

  !> Reals: `==` and `/=` take a tolerance, zero by default. A NaN satisfies no relation at all.
  subroutine compare_reals(relation, shape_a, shape_b, a, b, tolerance, message, location)
    character(*), intent(in) :: relation   !! ==, /=, <, <=, > or >=
    integer, intent(in) :: shape_a(:), shape_b(:)
    real(real64), intent(in) :: a(:), b(:)
    real(real64), intent(in), optional :: tolerance
    character(*), intent(in), optional :: message
    type(SourceLocation), intent(in), optional :: location
    real(real64) :: within
    logical :: is_held
    integer :: i, j

    if (.not. is_conformable(shape_a, shape_b, message, location)) return
    within = 0.0_real64
    if (present(tolerance)) within = tolerance
    do j = 1, size(b)
      i = min(j, size(a))
      is_held = is_held_by_order(relation, a(i) < b(j), a(i) > b(j), &
                                 a(i) <= b(j) .and. a(i) >= b(j))
      select case (relation)
      case ("==")
        is_held = is_held .or. abs(b(j) - a(i)) <= within
      case ("/=")
        is_held = is_held .and. abs(b(j) - a(i)) > within
      end select
      if (is_held) cycle
      call throw(described(relation, text(a(i)), text(b(j)), text(b(j) - a(i))) &
                 //tolerance_text(relation, within)//place(j, shape_b), message, location)
      return
    end do
  end subroutine compare_reals

  !> Default integers.
  subroutine compare_integers(relation, shape_a, shape_b, a, b, message, location)
    character(*), intent(in) :: relation   !! ==, /=, <, <=, > or >=
    integer, intent(in) :: shape_a(:), shape_b(:), a(:), b(:)
    character(*), intent(in), optional :: message
    type(SourceLocation), intent(in), optional :: location

    call compare(relation, shape_a, shape_b, int(a, int64), int(b, int64), message, location)
  end subroutine compare_integers

  !> Long integers.
  subroutine compare_long_integers(relation, shape_a, shape_b, a, b, message, location)
    character(*), intent(in) :: relation   !! ==, /=, <, <=, > or >=
    integer, intent(in) :: shape_a(:), shape_b(:)
    integer(int64), intent(in) :: a(:), b(:)
    character(*), intent(in), optional :: message
    type(SourceLocation), intent(in), optional :: location
    integer :: i, j

    if (.not. is_conformable(shape_a, shape_b, message, location)) return
    do j = 1, size(b)
      i = min(j, size(a))
      if (is_held_by_order(relation, a(i) < b(j), a(i) > b(j), a(i) == b(j))) cycle
      call throw(described(relation, integer_text(a(i)), integer_text(b(j)), &
                           integer_text(b(j) - a(i)))//place(j, shape_b), message, location)
      return
    end do
  end subroutine compare_long_integers

  !> Whether a relation holds between two numbers of which the order is known.
  pure logical function is_held_by_order(relation, is_less, is_greater, is_equal) result(is_held)
    character(*), intent(in) :: relation
    logical, intent(in) :: is_less, is_greater, is_equal

    select case (relation)
    case ("==")
      is_held = is_equal
    case ("/=")
      is_held = is_less .or. is_greater
    case ("<")
      is_held = is_less
    case ("<=")
      is_held = is_less .or. is_equal
    case (">")
      is_held = is_greater
    case (">=")
      is_held = is_greater .or. is_equal
    case default
      is_held = .false.
    end select
  end function is_held_by_order

  !> Fail and return false if an array meets one of another shape; a single value fits any shape.
  logical function is_conformable(shape_a, shape_b, message, location)
    integer, intent(in) :: shape_a(:), shape_b(:)
    character(*), intent(in), optional :: message
    type(SourceLocation), intent(in), optional :: location

    is_conformable = .true.
    if (size(shape_a) == 0) return
    is_conformable = all(shape_a == shape_b)
    if (is_conformable) return
    call throw("expected shape "//list_text(shape_a)//" but found shape "//list_text(shape_b), &
               message, location)
  end function is_conformable

  !> The failure in words: for `==` expected and found, for other relations what was to hold.
  pure function described(relation, a, b, difference)
    character(*), intent(in) :: relation, a, b, difference
    character(:), allocatable :: described

    if (relation == "==") then
      described = "expected "//a//" but found "//b//", difference "//difference
    else
      described = "expected "//a//" "//relation//" "//b//", which is not so"
    end if
  end function described

  pure function tolerance_text(relation, tolerance)
    character(*), intent(in) :: relation
    real(real64), intent(in) :: tolerance
    character(:), allocatable :: tolerance_text

    tolerance_text = ""
    if (relation == "==" .or. relation == "/=") then
      tolerance_text = " (tolerance "//text(tolerance)//")"
    end if
  end function tolerance_text

  !> Index of the element `j` in an array of this shape, empty for a scalar.
  pure function place(j, extents)
    integer, intent(in) :: j, extents(:)
    character(:), allocatable :: place
    integer :: index(size(extents)), k, rest

    place = ""
    if (size(extents) == 0) return
    rest = j - 1
    do k = 1, size(extents)
      index(k) = mod(rest, extents(k)) + 1
      rest = rest/extents(k)
    end do
    place = " at element "//list_text(index)
  end function place

  pure function list_text(list)
    integer, intent(in) :: list(:)
    character(:), allocatable :: list_text
    integer :: k

    list_text = "["
    do k = 1, size(list)
      if (k > 1) list_text = list_text//", "
      list_text = list_text//integer_text(int(list(k), int64))
    end do
    list_text = list_text//"]"
  end function list_text

  pure function text(value)
    real(real64), intent(in) :: value
    character(:), allocatable :: text
    character(32) :: buffer

    write (buffer, "(g0)") value
    text = trim(buffer)
  end function text

  pure function integer_text(value)
    integer(int64), intent(in) :: value
    character(:), allocatable :: integer_text
    character(20) :: buffer

    write (buffer, "(i0)") value
    integer_text = trim(buffer)
  end function integer_text

end module funit_compare
