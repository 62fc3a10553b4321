!> Whether a result that is to be gone on with has the datasets that the run would add to.
module result_layout
  use kinds, only: wp
  use text, only: string_t, strings, to_text
  use results_setup, only: results_setup_t
  use frame_values, only: display_t, new_display
  use hdf5_library, only: hid_t
  use hdf5_reading, only: open_for_reading, close_reading, names_in, read_numbers
  use vtkhdf, only: cells_t
  implicit none
  private

  public :: layout_problem

  character(*), parameter :: weights_name = "RationalWeights"   ! that Bezier cells have

contains

  !> What of *OUTPUT is not what the result was begun with, option by option with both values; empty
  !! if the frames of this set-up fit behind those of the file.
  function layout_problem(path, setup) result(reason)
    character(*), intent(in) :: path             !! of a result that is whole
    type(results_setup_t), intent(in) :: setup
    character(:), allocatable :: reason
    type(string_t), allocatable :: names(:)
    real(wp), allocatable :: n_points(:)
    type(display_t) :: display
    type(cells_t) :: cells
    real(wp), allocatable :: weights(:)
    integer(hid_t) :: file

    reason = "it cannot be opened"
    file = open_for_reading(path)
    if (file < 0) return
    names = names_in(file, "/VTKHDF/PointData")
    call read_numbers(file, "/VTKHDF/NumberOfPoints", n_points)
    call close_reading(file)
    reason = ""
    call new_display(setup, display, cells, weights)
    call compare("FIELDS", fields_word(names), fields_word(strings(display%fields%name)), reason)
    call compare("CELLS", cells_word(has(names, weights_name)), cells_word(setup%is_bezier), reason)
    if (reason == "") reason = other_problem(names, n_points, display)
  end function layout_problem

  !> What no option tells: a result of another version of the program.
  function other_problem(names, n_points, display) result(reason)
    type(string_t), intent(in) :: names(:)                 !! of the fields in the file
    real(wp), allocatable, intent(in) :: n_points(:)       !! points of its grid, as it says
    type(display_t), intent(in) :: display                 !! of the run now
    character(:), allocatable :: reason
    integer :: i, n

    reason = ""
    do i = 1, size(display%fields)
      if (.not. has(names, trim(display%fields(i)%name))) &
        reason = "it has no field "//trim(display%fields(i)%name)
    end do
    if (size(names) /= size(display%fields) + merge(1, 0, display%is_bezier) .and. reason == "") &
      reason = "it has "//to_text(size(names))//" fields, not those of this program"
    if (reason /= "") return
    n = 0
    if (allocated(n_points)) n = nint(sum(n_points))
    if (n /= display%n_points) reason = "its frames have "//to_text(n)//" points, those of the "// &
                                       "run now "//to_text(display%n_points)
  end function other_problem

  pure subroutine compare(option, was, now, reason)
    character(*), intent(in) :: option, was, now
    character(:), allocatable, intent(inout) :: reason

    if (was == now) return
    if (reason /= "") reason = reason//", and "
    reason = reason//"it was begun with *OUTPUT, "//option//"="//was//", and the deck now has "// &
            option//"="//now
  end subroutine compare

  !> The value of FIELDS that gives these fields.
  pure function fields_word(names) result(word)
    type(string_t), intent(in) :: names(:)
    character(:), allocatable :: word
    character(7), parameter :: words(0:2) = [character(7) :: "NONE", "CONTACT", "WEAR"]

    word = trim(words(count([has(names, "contact_pressure"), has(names, "wear")])))
  end function fields_word

  pure function cells_word(is_bezier) result(word)
    logical, intent(in) :: is_bezier
    character(:), allocatable :: word

    word = trim(merge("BEZIER  ", "LAGRANGE", is_bezier))
  end function cells_word

  pure logical function has(names, name)
    type(string_t), intent(in) :: names(:)
    character(*), intent(in) :: name
    integer :: i

    has = .false.
    do i = 1, size(names)
      has = has .or. names(i)%value == name
    end do
  end function has

end module result_layout
