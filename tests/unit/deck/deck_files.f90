!> Decks written and read by the tests of the deck layer.
module deck_files
  use input_errors, only: error_list_t
  use text, only: string_t
  use scene, only: scene_t
  use deck_reader, only: read_deck
  use error_report, only: error_line
  use text_files, only: write_file, write_bytes
  implicit none
  private

  public :: write_file, write_bytes, write_included, read_lines, has_error, all_errors, &
            no_overrides, source_path

  character(*), parameter, public :: feed = new_line("a")
  character(*), parameter, public :: main = "main.key"   !! of `write_included`

  !> A material, a blank of 20 x 10 x 1 and a step: what every deck needs.
  character(*), parameter, public :: material_lines = &
    "*MATERIAL, NAME=steel"//feed//"*DENSITY"//feed//"7.85e-9"//feed//"*ELASTIC"//feed// &
    "210000, 0.3"//feed
  character(*), parameter, public :: blank_lines = &
    "*BLANK, NAME=sheet, MATERIAL=steel"//feed//"x, 0, 20, 2, 4"//feed//"y, 0, 10, 2, 2"//feed// &
    "z, 0, 1, 2, 1"//feed
  character(*), parameter, public :: step_lines = "*DYNAMIC, EXPLICIT"//feed//"1.0e-3"//feed
  character(*), parameter, public :: base_lines = material_lines//blank_lines//step_lines

contains

  !> Write lines to a file, and the deck `main` that includes it: the reader does not warn of names
  !! in such a file that nothing uses, which most decks of one keyword have.
  subroutine write_included(path, lines)
    character(*), intent(in) :: path, lines

    call write_file(path, lines)
    call write_file(main, "*INCLUDE, INPUT="//path)
  end subroutine write_included

  !> Read a deck that includes these lines.
  subroutine read_lines(lines, scene, errors)
    character(*), intent(in) :: lines
    type(scene_t), intent(out) :: scene
    type(error_list_t), intent(out) :: errors

    call write_included("lines.key", lines)
    call read_deck(main, no_overrides(), scene, errors)
  end subroutine read_lines

  !> An empty list of --set options.
  function no_overrides() result(overrides)
    type(string_t), allocatable :: overrides(:)

    overrides = [string_t ::]
  end function no_overrides

  !> Does one error hold all the fragments?
  logical function has_error(errors, fragment, other, third)
    type(error_list_t), intent(in) :: errors
    character(*), intent(in) :: fragment
    character(*), intent(in), optional :: other, third
    character(:), allocatable :: line
    integer :: i

    has_error = .false.
    do i = 1, errors%n_items
      line = error_line(errors%items(i))
      if (index(line, fragment) == 0) cycle
      if (present(other)) then
        if (index(line, other) == 0) cycle
      end if
      if (present(third)) then
        if (index(line, third) == 0) cycle
      end if
      has_error = .true.
    end do
  end function has_error

  !> All errors as text, for a look at what went wrong.
  function all_errors(errors) result(lines)
    type(error_list_t), intent(in) :: errors
    character(:), allocatable :: lines
    integer :: i

    lines = ""
    do i = 1, errors%n_items
      lines = lines//error_line(errors%items(i))//feed
    end do
  end function all_errors

  !> Path of a file of the source tree, which CTest names in the environment.
  function source_path(relative) result(path)
    character(*), intent(in) :: relative
    character(:), allocatable :: path
    character(1000) :: root
    integer :: length

    call get_environment_variable("IGAFORM_SOURCE", root, length)
    path = root(:length)//"/"//relative
  end function source_path

end module deck_files
