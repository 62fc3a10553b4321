!> IGES files put together entity by entity, for tests of the reader.
module iges_drafts
  use input_errors, only: error_list_t, new_origin
  use text, only: string_t, to_text
  use nurbs_surface, only: nurbs_surface_t
  use iges_selection, only: iges_request_t, request_of => new_request
  use iges_reader, only: read_iges
  use text_files, only: write_file
  implicit none
  private

  public :: draft_t, add_entity, file_text, read_text, read_draft, new_request, has_error, told
  public :: has_line

  character(*), parameter, public :: feed = new_line("a")

  !> Parts of a file; the defaults are what most tests need.
  type :: draft_t
    character(:), allocatable :: directory, parameters   !! lines without their ends
    integer :: n_entities = 0, n_lines = 0
    character(2) :: delimiters = ",;"
    character(:), allocatable :: globals     !! global section; not allocated: millimetres
    character(:), allocatable :: line_end    !! not allocated: line feed
  end type draft_t

contains

  !> Add an entity; `values` is its list without the type and the delimiter at the end.
  subroutine add_entity(draft, type, values, form, matrix, status, label)
    type(draft_t), intent(inout) :: draft
    integer, intent(in) :: type
    character(*), intent(in) :: values
    integer, intent(in), optional :: form, matrix
    character(*), intent(in), optional :: status, label
    character(:), allocatable :: rest
    character(80) :: line
    character(8) :: code, name
    integer :: numbers(2), length, number, first

    numbers = 0
    if (present(form)) numbers(1) = form
    if (present(matrix)) numbers(2) = matrix
    code = "00000000"
    if (present(status)) code = status
    name = ""
    if (present(label)) name = label
    if (.not. allocated(draft%directory)) then
      draft%directory = ""
      draft%parameters = ""
    end if
    number = 2*draft%n_entities + 1
    first = draft%n_lines + 1
    rest = to_text(type)//draft%delimiters(1:1)//values//draft%delimiters(2:2)
    do while (len(rest) > 0)
      length = len(rest)
      if (length > 64) length = scan(rest(:64), draft%delimiters, back=.true.)
      draft%n_lines = draft%n_lines + 1
      write (line, "(a64, i8, a1, i7)") rest(:length)//repeat(" ", 64), number, "P", draft%n_lines
      draft%parameters = draft%parameters//line
      rest = rest(length + 1:)
    end do
    write (line, "(2i8, 4i8, i8, i8, a8, a1, i7)") type, first, 0, 0, 0, 0, numbers(2), 0, code, &
      "D", number
    draft%directory = draft%directory//line
    write (line, "(5i8, 16x, a8, i8, a1, i7)") type, 0, 0, draft%n_lines - first + 1, numbers(1), &
      name, 0, "D", number + 1
    draft%directory = draft%directory//line
    draft%n_entities = draft%n_entities + 1
  end subroutine add_entity

  !> The whole file.
  function file_text(draft) result(text)
    type(draft_t), intent(in) :: draft
    character(:), allocatable :: text, globals, feed_of_line
    character(80) :: line
    integer :: i, n

    feed_of_line = feed
    if (allocated(draft%line_end)) feed_of_line = draft%line_end
    globals = "1H,,1H;,,8HTEST.IGS,7Higaform,1H1,32,38,6,308,15,,1.,2,2HMM;"
    if (allocated(draft%globals)) globals = draft%globals
    write (line, "(a72, a1, i7)") "A file of a test"//repeat(" ", 72), "S", 1
    text = line//feed_of_line
    n = 0
    do while (len(globals) > 0)
      n = n + 1
      write (line, "(a72, a1, i7)") globals//repeat(" ", 72), "G", n
      globals = globals(min(73, len(globals) + 1):)
      text = text//line//feed_of_line
    end do
    do i = 1, 2*draft%n_entities
      text = text//draft%directory(80*i - 79:80*i)//feed_of_line
    end do
    do i = 1, draft%n_lines
      text = text//draft%parameters(80*i - 79:80*i)//feed_of_line
    end do
    write (line, "(4(a1, i7), 40x, a1, i7)") "S", 1, "G", n, "D", 2*draft%n_entities, "P", &
      draft%n_lines, "T", 1
    text = text//line//feed_of_line
  end function file_text

  !> All surfaces of test.igs, with their boxes, for a deck in millimetres.
  function new_request() result(request)
    type(iges_request_t) :: request

    request = request_of("test.igs", new_origin("test.key", 7, "*TOOL"))
  end function new_request

  !> Read a file of this text.
  subroutine read_text(text, surfaces, report, errors, request)
    character(*), intent(in) :: text
    type(nurbs_surface_t), allocatable, intent(out) :: surfaces(:)
    type(string_t), allocatable, intent(out) :: report(:)
    type(error_list_t), intent(out) :: errors
    type(iges_request_t), intent(in), optional :: request

    call write_file("test.igs", text)
    if (present(request)) then
      call read_iges(request, surfaces, report, errors)
    else
      call read_iges(new_request(), surfaces, report, errors)
    end if
  end subroutine read_text

  subroutine read_draft(draft, surfaces, report, errors, request)
    type(draft_t), intent(in) :: draft
    type(nurbs_surface_t), allocatable, intent(out) :: surfaces(:)
    type(string_t), allocatable, intent(out) :: report(:)
    type(error_list_t), intent(out) :: errors
    type(iges_request_t), intent(in), optional :: request

    call read_text(file_text(draft), surfaces, report, errors, request)
  end subroutine read_draft

  !> Is there an error in this line of the file that holds all fragments?
  logical function has_error(errors, line, fragment, other)
    type(error_list_t), intent(in) :: errors
    integer, intent(in) :: line
    character(*), intent(in) :: fragment
    character(*), intent(in), optional :: other
    character(:), allocatable :: words
    integer :: i

    has_error = .false.
    do i = 1, errors%n_items
      associate (item => errors%items(i))
        words = item%origin%keyword//": "//item%found//"; "//item%expected
        if (item%origin%line /= line .or. index(words, fragment) == 0) cycle
        has_error = .true.
        if (present(other)) has_error = index(words, other) > 0
        if (has_error) return
      end associate
    end do
  end function has_error

  !> All errors as text.
  function told(errors) result(text)
    type(error_list_t), intent(in) :: errors
    character(:), allocatable :: text
    integer :: i

    text = ""
    do i = 1, errors%n_items
      associate (item => errors%items(i))
        text = text//to_text(item%origin%line)//" "//item%origin%keyword//": "//item%found// &
               "; "//item%expected//feed
      end associate
    end do
  end function told

  !> Does one line of a report hold both fragments?
  logical function has_line(report, fragment, other)
    type(string_t), intent(in) :: report(:)
    character(*), intent(in) :: fragment, other
    integer :: i

    has_line = .false.
    do i = 1, size(report)
      if (index(report(i)%value, fragment) > 0 .and. index(report(i)%value, other) > 0) &
        has_line = .true.
    end do
  end function has_line

end module iges_drafts
