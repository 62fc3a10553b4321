!> What *TOOL says of a tool that is the offset of another one.
module offset_keywords
  use keyword_spec, only: keyword_table_t, add_option, add_line, add_field, kind_name, kind_real
  implicit none
  private

  public :: add_offset_option, add_offset_lines

contains

  !> Add the option to the keyword begun last.
  pure subroutine add_offset_option(table)
    type(keyword_table_t), intent(inout) :: table

    call add_option(table, "OF", kind_name, "OFFSET: name of the tool whose offset it is", &
                    is_required=.false.)
  end subroutine add_offset_option

  !> Add the data lines to the keyword begun last.
  pure subroutine add_offset_lines(table)
    type(keyword_table_t), intent(inout) :: table
    character(*), parameter :: axes = "xyz"
    integer :: i

    call add_line(table, "Distance from the tool OF. Above 0 it leads to where its sheet is, "// &
                  "and the sheet lies between the two; below 0 it leads away, and the sheet "// &
                  "lies on the side that OF has it.", when="OFFSET")
    call add_field(table, "distance", kind_real, "such as thickness and gap", unit="length")
    call add_field(table, "tolerance", kind_real, "largest error of the surface; 0: "// &
                   "1e-4 of the distance", unit="length", default="0", range=">= 0")
    call add_line(table, "Way from there to where the tool is at the start.", when="OFFSET", &
                  n_min=0)
    do i = 1, 3
      call add_field(table, "s"//axes(i:i), kind_real, "shift", unit="length")
    end do
  end subroutine add_offset_lines

end module offset_keywords
