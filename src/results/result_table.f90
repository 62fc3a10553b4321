!> Columns of numbers with names and units: written as a CSV file and as a group of an HDF5 file.
module result_table
  use kinds, only: wp
  use failure, only: error_t, fail
  use text, only: string_t, strings, to_text, joined
  use text_file, only: why_left_alone, write_lines
  use hdf5_file, only: hdf5_file_t, create_group, write_reals, write_text_attribute
  use unit_system, only: unit_system_t, unit_of
  implicit none
  private

  public :: add_column, n_rows, write_csv, write_group, tensor_components, quoted

  !> A quantity with one or more components.
  type, public :: column_t
    character(:), allocatable :: name
    character(:), allocatable :: quantity        !! such as time or stress, see `unit_of`
    character(:), allocatable :: text            !! description
    type(string_t), allocatable :: components(:) !! their names, empty for a single number
    real(wp), allocatable :: values(:, :)        !! shape (components, rows)
  end type column_t

  !> Columns with the same number of rows.
  type, public :: result_table_t
    type(column_t), allocatable :: columns(:)
  end type result_table_t

contains

  !> Add a column; all columns of a table need the same number of rows.
  subroutine add_column(table, name, quantity, text, values, components)
    type(result_table_t), intent(inout) :: table
    character(*), intent(in) :: name, quantity, text
    real(wp), intent(in) :: values(:, :)                     !! shape (components, rows)
    type(string_t), intent(in), optional :: components(:)    !! more than one component: names
    type(column_t) :: column

    column%name = name
    column%quantity = quantity
    column%text = text
    column%values = values
    allocate (column%components(0))
    if (present(components)) column%components = components
    if (.not. allocated(table%columns)) allocate (table%columns(0))
    table%columns = [table%columns, column]
  end subroutine add_column

  !> Names of the components of stress and strain.
  function tensor_components() result(names)
    type(string_t), allocatable :: names(:)

    names = strings(["11", "22", "33", "12", "13", "23"])
  end function tensor_components

  !> Number of rows.
  pure integer function n_rows(table)
    type(result_table_t), intent(in) :: table

    n_rows = 0
    if (allocated(table%columns)) n_rows = size(table%columns(1)%values, 2)
  end function n_rows

  !> Write the table as text: names with units, then a line a row. Fails if the file cannot be
  !! written; an older table of the same columns is replaced, or of those that `heads` names.
  subroutine write_csv(table, path, units, error, heads)
    type(result_table_t), intent(in) :: table
    character(*), intent(in) :: path
    type(unit_system_t), intent(in) :: units
    type(error_t), allocatable, intent(out) :: error
    type(string_t), intent(in), optional :: heads(:)   !! how first lines of other tables begin
    type(string_t) :: lines(n_rows(table) + 1)
    integer :: row
    character(:), allocatable :: why

    why = why_left_alone(path, head_line(table, units), "table of these columns")
    if (present(heads)) then
      do row = 1, size(heads)
        if (why /= "") why = why_left_alone(path, heads(row)%value, "such table")
      end do
    end if
    if (why == "") then
      lines(1)%value = head_line(table, units)
      do row = 1, n_rows(table)
        lines(row + 1)%value = row_line(table, row)
      end do
      call write_lines(path, lines, why)
    end if
    if (why /= "") call fail(error, "result file '"//path//"': "//why)
  end subroutine write_csv

  function head_line(table, units) result(line)
    type(result_table_t), intent(in) :: table
    type(unit_system_t), intent(in) :: units
    character(:), allocatable :: line, title
    integer :: i, k

    line = ""
    do i = 1, size(table%columns)
      associate (column => table%columns(i))
        do k = 1, size(column%values, 1)
          if (line /= "") line = line//","
          title = column%name
          if (size(column%components) > 0) title = title//"_"//column%components(k)%value
          title = title//" ["//unit_of(units, column%quantity)//"]"
          if (scan(title, ',"') > 0) title = quoted(title)
          line = line//title
        end do
      end associate
    end do
  end function head_line

  !> The text in quotes, as a field of CSV.
  pure function quoted(given) result(field)
    character(*), intent(in) :: given
    character(:), allocatable :: field
    integer :: i

    field = '"'
    do i = 1, len(given)
      field = field//given(i:i)
      if (given(i:i) == '"') field = field//'"'
    end do
    field = field//'"'
  end function quoted

  function row_line(table, row) result(line)
    type(result_table_t), intent(in) :: table
    integer, intent(in) :: row
    character(:), allocatable :: line
    integer :: i, k

    line = ""
    do i = 1, size(table%columns)
      do k = 1, size(table%columns(i)%values, 1)
        if (line /= "") line = line//","
        line = line//to_text(table%columns(i)%values(k, row))
      end do
    end do
  end function row_line

  !> Write the table as datasets of one group, rows first; those with components have them in their
  !! attribute `names`.
  subroutine write_group(table, file, folder, units)
    type(result_table_t), intent(in) :: table
    type(hdf5_file_t), intent(inout) :: file   !! keeps its failures, see `take_error`
    character(*), intent(in) :: folder         !! of the new group
    type(unit_system_t), intent(in) :: units
    integer :: i, n(2), first

    call create_group(file, folder)
    do i = 1, size(table%columns)
      associate (column => table%columns(i))
        if (size(column%values, 1) == 0) cycle
        n = shape(column%values)
        first = merge(2, 1, size(column%components) == 0)
        call write_reals(file, folder//"/"//column%name, column%values, n(first:), &
                         unit_of(units, column%quantity), column%text)
        if (size(column%components) > 0) &
          call write_text_attribute(file, folder//"/"//column%name, "names", &
                                    joined(column%components, ", "))
      end associate
    end do
  end subroutine write_group

end module result_table
