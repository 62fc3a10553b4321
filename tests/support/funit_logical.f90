!> Assertions on logical values, on shapes, on single reals, and on text.
module funit_logical
  use, intrinsic :: iso_fortran_env, only: real64
  use, intrinsic :: ieee_arithmetic, only: ieee_is_finite, ieee_is_nan
  use funit_failures, only: SourceLocation, throw
  implicit none
  private

  public :: assertTrue, assertFalse, assertAll, assertAny, assertNone, assertNotAll
  public :: assertSameShape, assertIsNaN, assertIsFinite, assertFail, assertEqual

  interface assertTrue
    module procedure true_scalar, assertAll
  end interface assertTrue

  interface assertFalse
    module procedure false_scalar, assertNone
  end interface assertFalse

  interface assertEqual
    module procedure equal_text, equal_texts
  end interface assertEqual

contains

  subroutine true_scalar(condition, message, location)
    logical, intent(in) :: condition
    character(*), intent(in), optional :: message
    type(SourceLocation), intent(in), optional :: location

    if (.not. condition) call throw("expected true but found false", message, location)
  end subroutine true_scalar

  subroutine false_scalar(condition, message, location)
    logical, intent(in) :: condition
    character(*), intent(in), optional :: message
    type(SourceLocation), intent(in), optional :: location

    if (condition) call throw("expected false but found true", message, location)
  end subroutine false_scalar

  subroutine assertAll(conditions, message, location)
    logical, intent(in) :: conditions(:)
    character(*), intent(in), optional :: message
    type(SourceLocation), intent(in), optional :: location

    if (.not. all(conditions)) call throw("expected all to be true", message, location)
  end subroutine assertAll

  subroutine assertAny(conditions, message, location)
    logical, intent(in) :: conditions(:)
    character(*), intent(in), optional :: message
    type(SourceLocation), intent(in), optional :: location

    if (.not. any(conditions)) call throw("expected one at least to be true", message, location)
  end subroutine assertAny

  subroutine assertNone(conditions, message, location)
    logical, intent(in) :: conditions(:)
    character(*), intent(in), optional :: message
    type(SourceLocation), intent(in), optional :: location

    if (any(conditions)) call throw("expected all to be false", message, location)
  end subroutine assertNone

  subroutine assertNotAll(conditions, message, location)
    logical, intent(in) :: conditions(:)
    character(*), intent(in), optional :: message
    type(SourceLocation), intent(in), optional :: location

    if (all(conditions)) call throw("expected one at least to be false", message, location)
  end subroutine assertNotAll

  subroutine assertSameShape(expected, found, message, location)
    integer, intent(in) :: expected(:), found(:)   !! shapes
    character(*), intent(in), optional :: message
    type(SourceLocation), intent(in), optional :: location
    character(80) :: words

    if (size(expected) == size(found)) then
      if (all(expected == found)) return
    end if
    write (words, "('expected shape ', *(i0, :, ' x '))") expected
    words = trim(words)//" but found shape"
    write (words(len_trim(words) + 2:), "(*(i0, :, ' x '))") found
    call throw(trim(words), message, location)
  end subroutine assertSameShape

  subroutine assertIsNaN(value, message, location)
    real(real64), intent(in) :: value
    character(*), intent(in), optional :: message
    type(SourceLocation), intent(in), optional :: location

    if (.not. ieee_is_nan(value)) call throw("expected a NaN but found a number", message, location)
  end subroutine assertIsNaN

  subroutine assertIsFinite(value, message, location)
    real(real64), intent(in) :: value
    character(*), intent(in), optional :: message
    type(SourceLocation), intent(in), optional :: location

    if (.not. ieee_is_finite(value)) call throw("expected a finite number", message, location)
  end subroutine assertIsFinite

  subroutine assertFail(message, location)
    character(*), intent(in) :: message
    type(SourceLocation), intent(in), optional :: location

    call throw(message, location=location)
  end subroutine assertFail

  !> Equal text; trailing blanks do not count.
  subroutine equal_text(expected, found, message, location)
    character(*), intent(in) :: expected, found
    character(*), intent(in), optional :: message
    type(SourceLocation), intent(in), optional :: location

    if (expected /= found) then
      call throw('expected "'//expected//'" but found "'//found//'"', message, location)
    end if
  end subroutine equal_text

  subroutine equal_texts(expected, found, message, location)
    character(*), intent(in) :: expected(:), found(:)
    character(*), intent(in), optional :: message
    type(SourceLocation), intent(in), optional :: location
    integer :: i

    call assertSameShape(shape(expected), shape(found), message, location)
    do i = 1, min(size(expected), size(found))
      call equal_text(expected(i), found(i), message, location)
    end do
  end subroutine equal_texts

end module funit_logical
