!> *TOOL with TYPE=IGES: the surfaces of a CAD file.
module cad_reader
  use kinds, only: wp
  use input_errors, only: error_list_t, add_error
  use text, only: string_t, upper_case, squeezed, read_integer
  use length_units, only: unit_in_mm
  use source_file, only: path_beside
  use iges_selection, only: iges_request_t
  use iges_reader, only: read_iges
  use scene, only: tool_spec_t
  use deck_records, only: record_t, parsed_deck_t, option_text, is_option_given
  implicit none
  private

  public :: read_cad_tool, check_cad_options

contains

  !> Read the surfaces of a tool and what the log says of them; without surfaces on an error.
  subroutine read_cad_tool(deck, record, units, tool, path, errors)
    type(parsed_deck_t), intent(in) :: deck
    type(record_t), intent(in) :: record
    character(*), intent(in) :: units                     !! what *UNITS says, empty: nothing
    type(tool_spec_t), intent(inout) :: tool
    character(:), allocatable, intent(out) :: path        !! of the file, empty if none is named
    type(error_list_t), intent(inout) :: errors
    type(iges_request_t) :: request
    logical :: is_there

    path = ""
    if (.not. is_option_given(deck, record, "INPUT")) then
      call add_error(errors, record%origin, "no option INPUT", "INPUT=file.igs for TYPE=IGES")
      return
    end if
    if (.not. record%is_valid) return
    request%origin = record%origin
    request%path = path_beside(record%origin%file, option_text(deck, record, "INPUT"))
    request%unit = deck_unit(deck, record, units)
    request%labels = entries_of(option_text(deck, record, "LABEL"))
    call read_numbers(deck, record, request%numbers, errors)
    inquire (file=request%path, exist=is_there)
    if (.not. is_there) then
      call add_error(errors, record%origin, "no file `"//request%path//"`", &
                     "the path of an IGES file, as the deck's folder sees it")
      return
    end if
    call read_iges(request, tool%surfaces, tool%notes, errors)
    path = request%path
  end subroutine read_cad_tool

  !> Refuse the options of CAD files for a tool of another type.
  subroutine check_cad_options(deck, record, errors)
    type(parsed_deck_t), intent(in) :: deck
    type(record_t), intent(in) :: record
    type(error_list_t), intent(inout) :: errors
    character(*), parameter :: options(4) = [character(6) :: "INPUT", "LENGTH", "ENTITY", "LABEL"]
    integer :: i

    do i = 1, size(options)
      if (.not. is_option_given(deck, record, trim(options(i)))) cycle
      call add_error(errors, record%origin, "the option "//trim(options(i))//" for a tool of "// &
                     "TYPE="//option_text(deck, record, "TYPE"), "this option with TYPE=IGES only")
    end do
  end subroutine check_cad_options

  !> The unit of LENGTH, else that of *UNITS, else millimetres.
  function deck_unit(deck, record, units) result(unit)
    type(parsed_deck_t), intent(in) :: deck
    type(record_t), intent(in) :: record
    character(*), intent(in) :: units
    character(:), allocatable :: unit
    type(string_t), allocatable :: named(:)
    integer :: i

    unit = option_text(deck, record, "LENGTH")
    if (unit /= "") return
    unit = "MM"
    named = entries_of(units)
    do i = 1, size(named)
      if (.not. unit_in_mm(named(i)%value) > 0.0_wp) cycle
      unit = upper_case(named(i)%value)
      return
    end do
  end function deck_unit

  subroutine read_numbers(deck, record, numbers, errors)
    type(parsed_deck_t), intent(in) :: deck
    type(record_t), intent(in) :: record
    integer, allocatable, intent(out) :: numbers(:)
    type(error_list_t), intent(inout) :: errors
    type(string_t), allocatable :: words(:)
    integer :: i, first
    logical :: is_number

    words = entries_of(option_text(deck, record, "ENTITY"))
    allocate (numbers(size(words)))
    do i = 1, size(words)
      first = merge(2, 1, upper_case(words(i)%value(1:1)) == "D" .and. len(words(i)%value) > 1)
      call read_integer(words(i)%value(first:), numbers(i), is_number)
      if (.not. is_number) call add_error(errors, record%origin, "`"//words(i)%value// &
                                          "` in ENTITY", "directory numbers such as ""5,9""")
    end do
  end subroutine read_numbers

  !> The entries of a list that commas separate; empty ones are left out.
  pure function entries_of(list) result(entries)
    character(*), intent(in) :: list
    type(string_t), allocatable :: entries(:)
    type(string_t) :: entry
    integer :: first, length

    allocate (entries(0))
    first = 1
    do while (first <= len(list))
      length = index(list(first:)//",", ",") - 1
      entry%value = squeezed(list(first:first + length - 1))
      if (entry%value /= "") entries = [entries, entry]
      first = first + length + 1
    end do
  end function entries_of

end module cad_reader
