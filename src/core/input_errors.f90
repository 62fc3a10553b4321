!> Errors of a deck: collected while reading, reported all in one go.
module input_errors
  implicit none
  private

  public :: origin_t, input_error_t, error_list_t, new_origin, n_errors
  public :: add_error, add_warning, drop_warnings, has_error_at

  !> The place in a deck that something came from.
  type :: origin_t
    character(:), allocatable :: file      !! path as the user wrote it
    integer :: line = 0                    !! line number from 1, 0 where no line is meant
    character(:), allocatable :: keyword   !! such as *BLANK, empty outside keywords
  end type origin_t

  !> One error: where, what stood there, what was expected.
  type :: input_error_t
    type(origin_t) :: origin
    logical :: is_warning = .false.
    character(:), allocatable :: found      !! what the deck says
    character(:), allocatable :: expected   !! what would be right, with the nearest valid name
  end type input_error_t

  !> All errors so far, in the order of discovery: the first `n_items` of `items`.
  type :: error_list_t
    integer :: n_items = 0
    type(input_error_t), allocatable :: items(:)   !! grown by doubling, so longer than `n_items`
  end type error_list_t

contains

  !> A place in a deck; line 0 stands for the whole file.
  pure function new_origin(file, line, keyword) result(origin)
    character(*), intent(in) :: file, keyword
    integer, intent(in) :: line
    type(origin_t) :: origin

    origin%file = file
    origin%line = line
    origin%keyword = keyword
  end function new_origin

  !> Note an error; reading goes on.
  pure subroutine add_error(list, origin, found, expected)
    type(error_list_t), intent(inout) :: list
    type(origin_t), intent(in) :: origin
    character(*), intent(in) :: found, expected
    type(input_error_t), allocatable :: longer(:)

    if (.not. allocated(list%items)) allocate (list%items(8))
    if (list%n_items == size(list%items)) then
      allocate (longer(2*list%n_items))
      longer(:list%n_items) = list%items
      call move_alloc(longer, list%items)
    end if
    list%n_items = list%n_items + 1
    associate (item => list%items(list%n_items))
      item%origin = origin
      if (allocated(origin%keyword)) item%origin%keyword = shortened(origin%keyword)
      item%is_warning = .false.
      item%found = shortened(found)
      item%expected = shortened(expected)
    end associate
  end subroutine add_error

  !> Note something suspicious that does not prevent the run.
  pure subroutine add_warning(list, origin, found, expected)
    type(error_list_t), intent(inout) :: list
    type(origin_t), intent(in) :: origin
    character(*), intent(in) :: found, expected

    call add_error(list, origin, found, expected)
    list%items(list%n_items)%is_warning = .true.
  end subroutine add_warning

  !> Take back the warnings of a place, where an error has shown what they come from.
  pure subroutine drop_warnings(list, origin)
    type(error_list_t), intent(inout) :: list
    type(origin_t), intent(in) :: origin
    integer :: i, n_kept

    n_kept = 0
    do i = 1, list%n_items
      associate (item => list%items(i))
        if (item%is_warning .and. item%origin%line == origin%line) then
          if (item%origin%file == origin%file) cycle
        end if
      end associate
      n_kept = n_kept + 1
      if (n_kept < i) list%items(n_kept) = list%items(i)
    end do
    list%n_items = n_kept
  end subroutine drop_warnings

  !> Is there an error, not only a warning, at a place?
  pure logical function has_error_at(list, origin)
    type(error_list_t), intent(in) :: list
    type(origin_t), intent(in) :: origin
    integer :: i

    has_error_at = .false.
    do i = 1, list%n_items
      associate (item => list%items(i))
        if (item%is_warning .or. item%origin%line /= origin%line) cycle
        has_error_at = has_error_at .or. item%origin%file == origin%file
      end associate
    end do
  end function has_error_at

  !> Number of errors that prevent the run (warnings do not count).
  pure integer function n_errors(list)
    type(error_list_t), intent(in) :: list

    n_errors = 0
    if (allocated(list%items)) n_errors = count(.not. list%items(:list%n_items)%is_warning)
  end function n_errors

  !> A text that may echo what a deck says, without its middle where it is too long to be read.
  pure function shortened(text) result(short)
    character(*), intent(in) :: text
    character(:), allocatable :: short
    integer, parameter :: longest = 600, n_first = 300, n_last = 200
    integer :: first, last

    short = text
    if (len(text) <= longest) return
    first = n_first
    last = len(text) - n_last + 1
    do while (is_inside_character(text(first + 1:first + 1)))
      first = first - 1
    end do
    do while (is_inside_character(text(last:last)))
      last = last + 1
    end do
    short = text(:first)//" ... "//text(last:)
  end function shortened

  !> Is a byte one of those behind the first of a character in UTF-8?
  pure logical function is_inside_character(byte)
    character(1), intent(in) :: byte

    is_inside_character = iachar(byte) >= 128 .and. iachar(byte) < 192
  end function is_inside_character

end module input_errors
